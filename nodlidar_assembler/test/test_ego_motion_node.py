"""The assembler node with odometry from TF, on real DDS, against the same data offline."""

from dataclasses import replace
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
import node_bench
from node_bench import NodeBench, SCAN_NS, sensor_log, simulated, START_NS
from nodlidar_assembler.bags.sensor_log import assemble_log, SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimitsConfig
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2
from sensor_msgs_py import point_cloud2
from tf2_msgs.msg import TFMessage
from tf2_ros import Buffer, TransformListener

MOUNT = Pose.from_xyzrpy((0.1, 0.0, 1.0, 0.0, 0.0, 0.0))


@pytest.fixture(scope='module')
def log():
    """Return what the sensor publishes on a robot that drives a curve, and its odometry."""
    return driven('room', 2.0, base_velocity=(0.4, 0.5))


def driven(scene, duration, **motion):
    """Return what the sensor publishes on a robot in a scene, and its odometry."""
    moving = replace(load_scene(scene, ideal=True), mount=MOUNT, **motion)
    recording = simulated(moving, duration)
    x, y, yaw = recording.odometry_pose.T
    zero = np.zeros_like(x)
    orientation = np.stack([zero, zero, np.sin(yaw / 2), np.cos(yaw / 2)], axis=1)
    base = Odometry(
        recording.odometry_stamp_ns, Poses(np.stack([x, y, zero], axis=1), orientation)
    )
    return sensor_log(recording, base)


class OdometryBench(NodeBench):
    """An assembler node that compensates the motion, and odometry on TF."""

    def __init__(self, parameters):
        beam = () if 'profile:=slam' in parameters else ('ego_motion:=beam',)
        super().__init__((*beam, 'command_nod:=false', *parameters))
        kinds = (PointCloud2, DiagnosticArray, NodCommand)
        self.clouds, self.diagnostics, self.commands = (self.out[kind] for kind in kinds)
        static = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._tf = self.feeder.create_publisher(TFMessage, '/tf', 100)
        self._tf_static = self.feeder.create_publisher(TFMessage, '/tf_static', static)
        self.spin_until_heard(self._tf, self._tf_static)

    def feed(self, log, odometry_delay_ns=0):
        """Publish a log and its odometry in the order of time, letting the node keep up."""
        mount = transform('base_link', 'nodlidar_base_link', 0, MOUNT.position, (0, 0, 0, 1))
        self._tf_static.publish(TFMessage(transforms=[mount]))
        messages = []
        base = log.odometry
        for stamp_ns, p, q in zip(
            base.time_ns, base.poses.position, base.poses.orientation, strict=True
        ):
            message = TFMessage(transforms=[transform('odom', 'base_link', stamp_ns, p, q)])
            messages.append((stamp_ns + odometry_delay_ns, self._tf, message))
        super().feed(log, messages)

    def reported(self, key):
        """Return the last value of a key in the diagnostics, 0 if there is none."""
        found = [
            value.value
            for array in self.diagnostics
            for status in array.status
            for value in status.values
            if value.key == key
        ]
        return int(found[-1]) if found else 0


bench = partial(node_bench.bench, kind=OdometryBench)


def transform(parent, child, stamp_ns, position, orientation):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = time_message(int(stamp_ns))
    p, q = message.transform.translation, message.transform.rotation
    p.x, p.y, p.z = map(float, position)
    q.x, q.y, q.z, q.w = map(float, orientation)
    return message


def offline(log, cloud_mode='scan', ego_motion='beam'):
    """Return the clouds that the same data give without ROS."""
    moved = replace(log, odometry=log.odometry.mounted(MOUNT))
    config = PipelineConfig(cloud_mode=cloud_mode, ego_motion=ego_motion)
    clouds, drops = assemble_log(moved, config)
    assert not drops
    return clouds


def part_of(odometry, kept, shift=0.0):
    poses = Poses(odometry.poses.position[kept] + shift, odometry.poses.orientation[kept])
    return Odometry(odometry.time_ns[kept], poses)


def assert_same(clouds, expected, frame_id='odom', point=0, times=()):
    for cloud, points in zip(clouds, expected, strict=True):
        assert cloud.header.frame_id == frame_id
        assert time_ns(cloud.header.stamp) == points.time_ns[point]
        got = point_cloud2.read_points(cloud)
        assert got.dtype.names == ('x', 'y', 'z', 'intensity', *times, 'ring')
        for name in got.dtype.names:
            np.testing.assert_allclose(got[name], points.data[name], atol=2e-6)


@pytest.mark.parametrize(('cloud_mode', 'delay_ns'), [('scan', 150_000_000), ('sweep', 0)])
def test_clouds_are_those_of_the_same_data_offline_also_when_tf_is_late(log, cloud_mode, delay_ns):
    expected = offline(log, cloud_mode)
    with bench(f'cloud_mode:={cloud_mode}', 'deadline:=10.0') as running:
        running.feed(log, delay_ns)
        running.spin_until(lambda: len(running.clouds) >= len(expected))
        assert_same(running.clouds, expected)


def test_the_profile_for_slam_gives_deskewed_sweeps(log):
    expected = offline(log, 'sweep', 'deskew')
    with bench('profile:=slam', 'deadline:=10.0') as running:
        running.feed(log)
        running.spin_until(lambda: len(running.clouds) >= len(expected))
        assert_same(running.clouds, expected, 'nodlidar_base_link', -1, times=('age',))


@pytest.mark.parametrize('cloud_mode', ['scan', 'sweep'])
def test_clouds_have_times_if_so_told(log, cloud_mode):
    expected = offline(log, cloud_mode)
    parameters = f'cloud_mode:={cloud_mode}', 'time_in_compensated_clouds:=true', 'deadline:=10.0'
    with bench(*parameters) as running:
        running.feed(log)
        running.spin_until(lambda: len(running.clouds) >= len(expected))
        for cloud, points in zip(running.clouds, expected, strict=True):
            assert cloud.header.frame_id == 'odom'
            got = point_cloud2.read_points(cloud)
            since = (points.time_ns - points.time_ns[0]) / 1e9
            np.testing.assert_allclose(got['time'], since, atol=1e-7)
            np.testing.assert_allclose(got['x'], points.data['x'], atol=2e-6)


def test_a_million_metres_out_tf_takes_clouds_to_where_they_are_in_the_frame_of_odometry(log):
    out = 1e6
    near, far = offline(log), replace(log, odometry=part_of(log.odometry, slice(None), out))
    with bench('deadline:=10.0') as running:
        running.feed(far)
        running.spin_until(lambda: len(running.clouds) >= len(near))
        heard = Buffer()
        listening = TransformListener(heard, running.feeder)  # a late listener hears it, too
        frame = 'odom_999424_999424_999424'
        running.spin_until(lambda: heard.can_transform('odom', frame, Time()))
        shift = heard.lookup_transform('odom', frame, Time()).transform
        listening.unregister()
    assert shift.rotation.w == 1.0
    for cloud, points in zip(running.clouds, near, strict=True):
        assert cloud.header.frame_id == frame
        got = point_cloud2.read_points(cloud)
        for axis in 'xyz':
            there = got[axis].astype(float) + getattr(shift.translation, axis) - out
            np.testing.assert_allclose(there, points.data[axis], rtol=0, atol=0.05e-3)


def test_without_tf_every_scan_is_dropped_and_counted(log):
    silent = replace(log, odometry=part_of(log.odometry, slice(0)))
    reason = 'dropped: no odometry after it before the deadline'
    with bench('deadline:=2.0') as running:  # joint states are to come in time
        running.feed(silent)
        running.spin_until(lambda: running.reported(reason) == len(log.scans))
        assert not running.clouds


def test_odometry_of_a_clock_that_is_ahead_is_named():
    with bench() as running:
        node = running.node

        def warned(ahead):
            stamp_ns = node.get_clock().now().nanoseconds + round(ahead * 1e9)
            direct = transform('odom', 'nodlidar_base_link', stamp_ns, (0, 0, 0), (0, 0, 0, 1))
            running._tf.publish(TFMessage(transforms=[direct]))
            running.spin_until(lambda: node.odometry.newest_ns == stamp_ns)
            return [text for text in node.diagnosis._warnings() if 'in the future' in text]

        assert not warned(0.05)
        (text,) = warned(0.4)
        assert 'odometry is stamped 0.' in text
        assert 'synchronise the clocks' in text


@pytest.mark.parametrize(('ahead', 'named'), [(0.9, []), (5.0, ['5.0 s after scans'])])
def test_scans_of_a_clock_behind_that_of_odometry_are_named(ahead, named):
    last = driven('wall', 0.5).scans[-1]
    newest_ns = last.end_ns + round(ahead * 1e9)
    sent = transform('odom', 'nodlidar_base_link', newest_ns, (0, 0, 0), (0, 0, 0, 1))
    with bench() as running:
        diagnosis = running.node.diagnosis
        running._tf.publish(TFMessage(transforms=[sent]))
        running.spin_until(lambda: running.node.odometry.newest_ns == newest_ns)
        diagnosis.scan_arrived(last)
        found = [text for text in diagnosis._warnings() if 'after scans' in text]
    assert found == [f'odometry is stamped {text}: synchronise the clocks' for text in named]


def test_odometry_that_is_sent_again_with_newer_stamps_is_named():
    with bench() as running:
        node = running.node
        for k in range(80):
            place = (0.1 * (k // 5), 0.0, 0.0)
            sent = transform(
                'odom', 'nodlidar_base_link', START_NS + 20_000_000 * k, place, (0, 0, 0, 1)
            )
            running._tf.publish(TFMessage(transforms=[sent]))
        running.spin_until(lambda: node.odometry.newest_ns == START_NS + 20_000_000 * 79)
        (text,) = [text for text in node.diagnosis._warnings() if 'changes every' in text]
        assert 'stamped every 20 ms, but changes every 100 ms' in text


def test_odometry_that_flaps_between_two_values_is_named():
    with bench() as running:
        node = running.node
        for k in range(80):
            place = (0.01 * k + 0.05 * (k % 2), 0.0, 0.0)
            sent = transform(
                'odom', 'nodlidar_base_link', START_NS + 20_000_000 * k, place, (0, 0, 0, 1)
            )
            running._tf.publish(TFMessage(transforms=[sent]))
        running.spin_until(lambda: node.odometry.newest_ns == START_NS + 20_000_000 * 79)
        assert any('50 mm off RMS' in text for text in node.diagnosis._warnings())


def test_without_odometry_scans_are_uncompensated_in_their_own_frame_if_so_told(log):
    late = log.odometry.time_ns > log.scans[-1].stamp_ns + SCAN_NS
    begins_after = replace(log, odometry=part_of(log.odometry, late))
    expected, _ = assemble_log(replace(log, odometry=None), PipelineConfig())
    key = 'uncompensated: no odometry before it'
    with bench('deadline:=10.0', 'without_odometry:=uncompensated') as running:
        running.feed(begins_after)
        running.spin_until(lambda: running.reported(key) == len(log.scans))
        running.spin_until(lambda: len(running.clouds) == len(expected))
        for cloud, points in zip(running.clouds, expected, strict=True):
            assert cloud.header.frame_id == 'nodlidar_base_link'
            got = point_cloud2.read_points(cloud)
            for name in points.data.dtype.names:
                np.testing.assert_array_equal(got[name], points.data[name])


def test_scans_in_a_jump_or_a_gap_are_dropped_and_the_others_are_whole(log):
    base = log.odometry
    seconds = (base.time_ns - START_NS) / 1e9
    jumped = (seconds > 0.53)[:, None] * np.array([0.5, 0.0, 0.0])  # within the scan at 0.5 s
    kept = ~((seconds > 1.1) & (seconds < 1.35))
    broken = replace(log, odometry=part_of(base, kept, jumped[kept]))
    stamps = np.array([scan.stamp_ns - START_NS for scan in log.scans]) / 1e9
    in_gap = int(np.sum((stamps + SCAN_NS / 1e9 > 1.1) & (stamps < 1.36)))
    with bench('deadline:=10.0') as running:
        running.feed(broken)
        running.spin_until(
            lambda: (
                running.reported('dropped: odometry jumps: it moves faster than 5.0 m/s') == 1
                and running.reported('dropped: odometry more than 0.2 s apart') == in_gap
            )
        )
        running.spin_until(lambda: len(running.clouds) == len(log.scans) - 1 - in_gap)
        got = {time_ns(cloud.header.stamp): cloud for cloud in running.clouds}
    before = [c for c in offline(log) if c.time_ns[0] in got and c.time_ns[0] < START_NS + 0.5e9]
    assert_same([got[int(c.time_ns[0])] for c in before], before)
    assert len(before) >= 4


def test_when_all_time_goes_back_the_clouds_are_those_of_the_earlier_time(log):
    shift_ns = 100_000_000_000
    base = log.odometry
    scans = [replace(scan, stamp_ns=scan.stamp_ns - shift_ns) for scan in log.scans]
    earlier = SensorLog(
        scans, log.sample_ns - shift_ns, log.sample_pitch,
        Odometry(base.time_ns - shift_ns, base.poses),
    )  # fmt: skip
    with bench('deadline:=10.0') as running:
        for k, part in enumerate((log, earlier), start=1):
            running.feed(part)
            running.spin_until(lambda k=k: len(running.clouds) == k * len(log.scans))
        assert_same(running.clouds, [*offline(log), *offline(earlier)])


@pytest.mark.parametrize(
    ('key', 'changes'),
    [
        ('odom_frame', {'odom_frame': 'nodlidar_base_link'}),
        ('odom_frame', {'odom_frame': ''}),
        ('without_odometry', {'cloud_mode': 'sweep', 'without_odometry': 'uncompensated'}),
        ('ego_motion', {'ego_motion': 'scan'}),
    ],
)
def test_parameters_that_do_not_go_with_each_other(key, changes):
    with pytest.raises(ParameterError, match=f"'{key}' must be"):
        check(AssemblerConfig(**({'ego_motion': 'beam'} | changes)))


@pytest.mark.parametrize('ego_motion', ['beam', 'off'])
def test_limits_are_for_where_odometry_says_that_the_robot_is(ego_motion):
    """By the window of the median alone they would be for 0.4 m farther away."""
    log = driven('wall', 2.5, base_start=(-1.5, 0.0, 0.0), base_velocity=(0.5, 0.0))
    # The optical centre is 0.1 m ahead of the robot, whose wheels are 3.5 m from the wall.
    distance = 3.5 - 0.1 - 0.5 * (log.scans[-1].stamp_ns - START_NS) / 1e9
    exact, late = (
        limits_at(PitchLimitsConfig(), share * distance / np.cos(np.radians(15.0)))[1]
        for share in (0.97, 1.07)  # until the commands come; the hysteresis
    )
    followed = 'command_nod:=true', 'adapt_limits:=true', 'limits_rate:=20.0'
    with bench(f"ego_motion:='{ego_motion}'", *followed) as running:
        running.feed(log)
        running.spin_until(lambda: len(running.clouds) >= len(log.scans))
        commands = running.commands
        running.spin_until(lambda: commands and late < commands[-1].pitch_max < exact)
    frame = {'beam': 'odom', 'off': 'nodlidar_base_link'}[ego_motion]
    assert {cloud.header.frame_id for cloud in running.clouds} == {frame}


def test_without_compensation_tf_is_heard_while_limits_follow_the_range():
    """Its absence is no fault then."""
    log = driven('wall', 0.5)
    silent = replace(log, odometry=part_of(log.odometry, slice(0)))
    with node_bench.bench('command_nod:=false') as running:
        listens = lambda: running.feeder.count_subscribers('/tf')  # noqa: E731
        assert not listens()
        for adapts in (True, False, True):
            running.node.set_parameters([Parameter('adapt_limits', value=adapts)])
            running.spin_until(lambda a=adapts: listens() == a)
        running.feed(silent)
        clouds, diagnostics = running.out[PointCloud2], running.out[DiagnosticArray]
        running.spin_until(lambda: len(clouds) >= len(log.scans) and diagnostics)
    states = [s for array in diagnostics for s in array.status if s.name == 'assembler: clouds']
    assert states
    assert not any('TF' in state.message or 'odometry' in state.message for state in states)
