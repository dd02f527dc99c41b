"""The action scan_region on real DDS: taking the nod over, giving it back, refusals."""

from action_msgs.msg import GoalStatus
from node_bench import bench
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimitsConfig
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.action import ScanRegion
from nodlidar_msgs.msg import NodCommand, NodStatus
import numpy as np
import pytest
from rclpy.action import ActionClient
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan, PointCloud2
from sensor_msgs_py import point_cloud2
from test_assembler_node import log

__all__ = ['log']

OWN = -0.6136, 0.6136
# So coarse that the nod of the log, which does not follow, sees it in a second.
COARSE = ScanRegion.Goal(
    pitch_min=-0.3, pitch_max=0.3, azimuth_min=-0.5, azimuth_max=1.0, cell=0.25
)
FINE = ScanRegion.Goal(pitch_min=-0.3, pitch_max=0.3, cell=0.01)


class Client:
    """A client of the action of a bench."""

    def __init__(self, running):
        self.running, self.feedback = running, []
        self.client = ActionClient(running.feeder, ScanRegion, 'assembler/scan_region')
        running.spin_until(self.client.server_is_ready)

    def send(self, goal):
        """Send a goal; return its handle once it is accepted."""
        sent = self.client.send_goal_async(
            goal, feedback_callback=lambda message: self.feedback.append(message.feedback)
        )
        self.running.spin_until(sent.done)
        assert sent.result().accepted
        return sent.result()

    def result(self, handle):
        """Return status and result of a goal."""
        got = handle.get_result_async()
        self.running.spin_until(got.done)
        return got.result().status, got.result().result


def limits_of(command):
    return command.pitch_min, command.pitch_max


def parts(log, first):
    """Return the first scans of a log, and the others, with all samples that have not come."""
    stamp_ns = log.scans[first].stamp_ns
    early = log.sample_ns <= stamp_ns
    return (
        SensorLog(log.scans[:first], log.sample_ns[early], log.sample_pitch[early]),
        SensorLog(log.scans[first:], log.sample_ns[~early], log.sample_pitch[~early]),
    )


def test_a_region_is_scanned_and_the_nod_given_back(log):
    before, after = parts(log, 5)
    with bench() as running:
        client = Client(running)
        running.feed(before)
        handle = client.send(COARSE)
        commands = running.out[NodCommand]
        running.spin_until(lambda: limits_of(commands[-1]) != OWN)
        running.feed(after)
        status, result = client.result(handle)
        running.spin_until(lambda: limits_of(commands[-1]) == OWN)
        assert not running.node.survival.errors
    assert (status, result.success) == (GoalStatus.STATUS_SUCCEEDED, True)
    taken = [command for command in commands if limits_of(command) != OWN]
    assert all(limits_of(command) == pytest.approx((-0.4, 0.4)) for command in taken)
    # First the way to the limit, at once, then the nod from when it is there.
    way, nod = taken[0], taken[-1]
    assert way.start_time.sec == 0
    assert nod.start_time.sec > 0
    assert way.sweep_duration < nod.sweep_duration
    assert commands[-1].samples_per_sweep == commands[0].samples_per_sweep
    coverage = result.coverage
    assert (coverage.seen, coverage.largest_hole) == (1.0, 0.0)
    assert coverage.cells == 3 * 8  # 0.2 rad each: three equal rows
    assert 0.0 < result.duration == coverage.window == coverage.time_to_see_all
    assert result.predicted_time == pytest.approx(0.1 * 4 / 0.85 + 0.4, abs=0.3)
    points = point_cloud2.read_points(result.cloud)
    azimuth = np.arctan2(points['y'], np.hypot(points['x'], points['z']))
    assert azimuth.min() > -0.51
    assert azimuth.max() < 1.01
    assert 100 < len(points) <= coverage.beams
    assert result.cloud.header.frame_id == 'nodlidar_base_link'


def test_there_are_no_level_scans_while_a_region_is_scanned(log):
    before, after = parts(log, 18)
    found = []
    with bench('level_scan:=scan', 'deadline:=10.0') as running:
        running.feeder.create_subscription(LaserScan, 'level_scan', found.append, 50)
        [topic] = [p for p in running.node.publishers if p.topic_name == '/level_scan']
        running.spin_until_heard(topic)
        client = Client(running)
        running.feed(before)
        last_ns = before.scans[-1].stamp_ns
        running.spin_until(lambda: found and time_ns(found[-1].header.stamp) > last_ns)
        handle = client.send(FINE)
        running.spin_until(lambda: running.node.scans_region)
        clouds, known = running.out[PointCloud2], len(found)
        running.feed(after)
        # Of each scan, the cloud comes first: the level scans of all but the last have come, too.
        running.spin_until(lambda: len(clouds) >= len(log.scans) - 2)
        assert running.node.scans_region
        assert len(found) == known
        running.spin_until(handle.cancel_goal_async().done)


def test_limits_follow_the_range_again_after_a_region(log):
    """The wall is 2 m ahead, as in the tests of adapted limits."""
    adapted = pytest.approx(limits_at(PitchLimitsConfig(), 2.0 / 0.9659), abs=0.02)
    before, after = parts(log, 5)
    with bench('adapt_limits:=true') as running:
        client = Client(running)
        running.feed(before)
        handle = client.send(COARSE)
        running.feed(after)
        commands = running.out[NodCommand]
        status, _ = client.result(handle)
        running.spin_until(lambda: limits_of(commands[-1]) == adapted)
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert any(limits_of(command) == pytest.approx((-0.4, 0.4)) for command in commands)


def test_a_goal_is_cancelled_at_any_time_with_feedback_until_then(log):
    before, after = parts(log, 5)
    with bench('adapt_limits:=false') as running:
        client = Client(running)
        running.feed(before)
        handle = client.send(FINE)
        commands = running.out[NodCommand]
        running.feed(after)
        running.spin_until(lambda: len(client.feedback) >= 2)
        _, refused = client.result(client.send(COARSE))
        cancelled = handle.cancel_goal_async()
        running.spin_until(cancelled.done)
        status, result = client.result(handle)
        running.spin_until(lambda: limits_of(commands[-1]) == OWN)
        again = client.send(COARSE)  # it is free again
        running.spin_until(again.cancel_goal_async().done)
    assert refused.message == 'refused: another region is being scanned'
    assert (status, result.success, result.message) == (
        GoalStatus.STATUS_CANCELED, False, 'cancelled',
    )  # fmt: skip
    assert 0.0 < result.coverage.seen < 1.0
    assert result.cloud.width > 0
    feedback = client.feedback[-1]
    # On a busy computer, scans still arrive after it.
    assert 0.0 < feedback.seen <= result.coverage.seen + 1e-6
    assert 0.01 < feedback.largest_hole <= 0.6
    assert 0.0 < feedback.time_to_go < result.predicted_time


def test_a_goal_that_is_cancelled_before_it_begins_ends_no_other_one(log):
    """As when both requests arrive together: rclpy takes them before it executes the goal."""
    before, _ = parts(log, 5)
    with bench() as running:
        client = Client(running)
        running.feed(before)
        handle = client.send(FINE)
        running.spin_until(lambda: running.node.scans_region)
        running.node._region._cancel(None)
        running.spin_until(lambda: len(client.feedback) >= 1)
        assert running.node.scans_region
        running.spin_until(handle.cancel_goal_async().done)
        status, _ = client.result(handle)
    assert status == GoalStatus.STATUS_CANCELED


def test_a_goal_ends_at_its_time_limit_even_if_the_lidar_is_silent(log):
    before, _ = parts(log, 5)
    with bench() as running:
        client = Client(running)
        running.feed(before)
        handle = client.send(ScanRegion.Goal(time_limit=0.3))
        status, result = client.result(handle)
        running.spin_until(lambda: limits_of(running.out[NodCommand][-1]) == OWN)
    assert status == GoalStatus.STATUS_ABORTED
    assert 'the time limit of 0.3 s was over' in result.message


def test_what_cannot_be_scanned_is_refused_with_the_reason(log):
    with bench() as running:
        client = Client(running)
        refused = [client.result(client.send(COARSE))]
        running.feed(parts(log, 5)[0])
        outside = ScanRegion.Goal(pitch_min=-0.7, pitch_max=0.3)
        refused.append(client.result(client.send(outside)))
        # The servo knows more than the parameters.
        status = NodStatus(pitch_lower_limit=-0.65, pitch_upper_limit=0.65)
        publisher = running.feeder.create_publisher(NodStatus, 'servo/status', 1)
        running.spin_until_heard(publisher)
        publisher.publish(status)
        running.spin_until(lambda: running.node._region.pitch_limits == (-0.65, 0.65))
        refused.append(client.result(client.send(outside)))
        refused.append(client.result(client.send(ScanRegion.Goal(cell=0.001))))
        assert {limits_of(command) for command in running.out[NodCommand]} == {OWN}
        [heard] = [each for each in running.node.subscriptions if 'status' in each.topic_name]
        assert not heard.callback_group.can_execute(heard)  # it wakes nobody
    assert {status for status, _ in refused} == {GoalStatus.STATUS_ABORTED}
    reasons = [result.message for _, result in refused]
    assert reasons[0] == 'refused: no scans arrive'
    assert "'pitch_min' must be between -0.6136 and 0.6136 rad" in reasons[1]
    assert "'pitch_min' must be between -0.65 and 0.65 rad" in reasons[2]
    assert "'cell' must be at least 0.006136 rad" in reasons[3]


def test_a_nod_that_is_not_commanded_here_is_not_taken_over():
    with bench('command_nod:=false') as running:
        client = Client(running)
        _, result = client.result(client.send(COARSE))
    assert result.message.startswith('refused: the nod is not commanded by this node')


def test_of_many_goals_at_once_all_are_answered():
    with bench() as running:
        client = Client(running).client
        sent = [client.send_goal_async(COARSE) for _ in range(50)]
        running.spin_until(lambda: all(future.done() for future in sent))
        got = [future.result().get_result_async() for future in sent]
        running.spin_until(lambda: all(future.done() for future in got))
        cancelled = [future.result().cancel_goal_async() for future in sent]
        running.spin_until(lambda: all(future.done() for future in cancelled))
    assert {future.result().result.message for future in got} == {'refused: no scans arrive'}


def test_limits_beyond_those_of_the_mount_are_refused_when_they_are_set(log):
    with bench() as running:
        assert set_to(running, pitch_max=0.7) == ''
        mount = NodStatus(pitch_lower_limit=-0.7, pitch_upper_limit=0.7)
        running.spin_until_heard(
            status := running.feeder.create_publisher(NodStatus, 'servo/status', 1)
        )
        running.send(status, mount)
        running.spin_until(lambda: set_to(running, pitch_max=0.8) != '')
        assert 'between -0.7 and 0.7 rad, the limits of the mount' in set_to(
            running, pitch_max=0.8
        )
        assert set_to(running, object_distance=3.0) == ''
        assert set_to(running, pitch_max=0.65) == ''


def set_to(running, **value):
    """Set a parameter of the node; return why it is refused."""
    ((name, number),) = value.items()
    return running.node.set_parameters([Parameter(name, value=number)])[0].reason
