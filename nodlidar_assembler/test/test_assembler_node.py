"""The assembler node on real DDS, fed with simulated data, against the same data offline."""

from dataclasses import replace
import time

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from log_messages import scan_message, state_message
from node_bench import BEAM_PERIOD, bench, SCAN_NS, sensor_log, simulated, START_NS
from nodlidar_assembler.bags.sensor_log import assemble_log, SensorLog
from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_assembler.plausibility import stamp_drift
from nodlidar_assembler.profiles import PROFILES
from nodlidar_assembler.ros import diagnosis
from nodlidar_assembler.ros.assembly_filter import SEVERAL
from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_assembler.scan_assembler import ONE_INSTANT
from nodlidar_common.errors import ParameterError
from nodlidar_common.ros.messages import nod_from_message, time_message
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_msgs.msg import NodCommand
from nodlidar_msgs.srv import AssembleScans
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
import rclpy
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from sensor_msgs_py import point_cloud2

DURATION = 3.0


@pytest.fixture(scope='module')
def log():
    """Return what the reference sensor tells in the scene 'wall'."""
    return sensor_log(simulated(load_scene('wall', ideal=True), DURATION))


def texts(running):
    """Return the states that the diagnostics have told."""
    return [s.message for array in running.out[DiagnosticArray] for s in array.status]


@pytest.mark.parametrize(
    ('parameters', 'config'),
    [
        ((), PROFILES['balanced']),
        (('profile:=fast',), PROFILES['fast']),
        (
            ('profile:=fast', 'estimator:=ends'),
            replace(PROFILES['fast'], estimator='ends'),
        ),
    ],
)
def test_parameters_that_are_not_given_are_those_of_the_profile(parameters, config):
    with bench(*parameters) as running:
        assert running.node.config == config


def test_an_unknown_profile_is_refused():
    rclpy.init(args=['--ros-args', '-p', 'profile:=best'])
    with pytest.raises(ParameterError, match="'profile' must be one of fast, balanced"):
        AssemblerNode()
    rclpy.shutdown()


@pytest.mark.parametrize('estimator', ['nearest', 'ends', 'slerp', 'trajectory'])
@pytest.mark.parametrize('cloud_mode', ['scan', 'sweep'])
def test_clouds_are_those_of_the_same_data_offline(log, cloud_mode, estimator):
    log = replace(log, scans=log.scans[:-3])  # trajectory waits for samples after a scan
    expected, drops = assemble_log(log, PipelineConfig(estimator=estimator, cloud_mode=cloud_mode))
    assert not drops
    parameters = (f'cloud_mode:={cloud_mode}', f'estimator:={estimator}', 'deadline:=10.0')
    with bench(*parameters) as running:
        running.feed(log)
        clouds = running.out[PointCloud2]
        running.spin_until(lambda: len(clouds) >= len(expected))
    assert len(clouds) == len(expected)
    for cloud, points in zip(clouds, expected, strict=True):
        assert time_ns(cloud.header.stamp) == points.time_ns[0]
        assert cloud.header.frame_id == 'nodlidar_base_link'
        got = point_cloud2.read_points(cloud)
        for name in points.data.dtype.names:
            np.testing.assert_array_equal(got[name], points.data[name])


def test_the_nod_is_commanded_at_the_lidar_s_rate_and_in_its_phase(log):
    with bench('samples_per_sweep:=2745', 'pitch_min:=-0.2') as running:
        running.feed(log)
        running.spin_until(lambda: len(running.out[NodCommand]) >= 2)
    first, *others = running.out[NodCommand]
    nod = nod_from_message(first)
    assert (nod.pitch_min, nod.pitch_max, nod.samples_per_sweep) == (-0.2, 0.6136, 2745)
    assert nod.sweep_duration == pytest.approx(2745 * BEAM_PERIOD, rel=1e-6)
    assert abs(nod.reference_time_ns - log.scans[0].stamp_ns) < BEAM_PERIOD * 1e9
    beam_ns = BEAM_PERIOD * 1e9
    for other in map(nod_from_message, others):
        sample = (other.reference_time_ns - log.scans[0].stamp_ns) / beam_ns
        assert abs((sample + 0.5 + 2745) % 5490 - 2745) < 0.1
        assert other.sweep_duration == pytest.approx(2745 * BEAM_PERIOD, rel=1e-6)


@pytest.mark.parametrize(
    ('steps', 'warnings'),
    [(1024, ['1440']), (1440, []), (2880, [])],  # a lidar may thin its beams
)
def test_a_lidar_of_other_steps_is_warned_of(log, steps, warnings, capfd):
    step = np.float32(2 * np.pi / 1440)
    finer = replace(log.scans[0].geometry, angle_increment=step)
    with bench(f'steps_per_revolution:={steps}', 'samples_per_sweep:=4001') as running:
        scans = [replace(scan, geometry=finer) for scan in log.scans[:3]]
        running.feed(SensorLog(scans, log.sample_ns, log.sample_pitch))
        running.spin_until(lambda: running.out[NodCommand] and running.out[PointCloud2])
    lines = capfd.readouterr().err.splitlines()
    found = [line for line in lines if 'angle_increment of the scan implies' in line]
    assert len(found) == len(warnings)
    assert all('1440' in line for line in found)


def test_without_commanding_there_is_no_command(log):
    with bench('command_nod:=false') as running:
        assert all(p.topic_name != '/nod_command' for p in running.node.publishers)


def test_scans_sent_by_best_effort_are_heard_if_the_node_is_told_so():
    with bench('qos_overrides./scan.subscription.reliability:=best_effort') as running:
        publisher = running.feeder.create_publisher(LaserScan, 'scan', qos_profile_sensor_data)
        running.spin_until(publisher.get_subscription_count)


def test_scans_without_joint_states_are_dropped_counted_and_diagnosed(log):
    silent = SensorLog(log.scans[:3], log.sample_ns[:0], log.sample_pitch[:0])

    def reported(running):
        for array in running.out[DiagnosticArray]:
            for status in array.status:
                values = {value.key: value.value for value in status.values}
                if values.get('dropped: no joint state after it before the deadline') == '3':
                    assert 'no joint state was heard' in status.message
                    return status.level == DiagnosticStatus.ERROR and not running.out[PointCloud2]
        return False

    with bench('deadline:=0.05') as running:
        running.feed(silent)
        running.spin_until(lambda: reported(running))


def test_a_lidar_that_sees_nothing_is_named(log):
    nothing = np.full_like(log.scans[0].ranges, np.nan)
    sent = 0

    def warned(running):
        nonlocal sent
        scan = replace(
            log.scans[0], stamp_ns=log.scans[0].stamp_ns + sent * 100_000_000, ranges=nothing
        )
        running.send(running.scans, scan_message(scan))
        sent += 1
        texts = [s.message for array in running.out[DiagnosticArray] for s in array.status]
        return any('no range for 3 s: is the lidar covered?' in text for text in texts)

    with bench('deadline:=0.05') as running:
        running.spin_until(lambda: warned(running))
    assert sent > 3


def test_scans_that_state_no_times_of_their_beams_are_warned_of(log):
    timeless = [
        replace(scan, geometry=replace(scan.geometry, time_increment=0.0))
        for scan in log.scans[:10]
    ]

    def warned(running):
        states = [s for array in running.out[DiagnosticArray] for s in array.status]
        return any(s.level == DiagnosticStatus.WARN and ONE_INSTANT in s.message for s in states)

    with bench() as running:
        running.feed(replace(log, scans=timeless))
        running.spin_until(lambda: warned(running))


def test_stamps_that_move_while_scans_come_as_before_are_warned_of(log):
    period_ns, moved_ns = 50_000_000, 20_000_000
    geometry = replace(log.scans[0].geometry, time_increment=period_ns / 1e9 / 1024)

    def warned(running):
        return any('ms later than before, but come as before' in t for t in texts(running))

    def now_ns(running):
        return running.node.get_clock().now().nanoseconds

    with bench('use_sim_time:=true') as running:
        clock = running.feeder.create_publisher(Clock, '/clock', 10)
        heard = []
        running.node.scans.registerCallback(heard.append)
        running.spin_until_heard(clock)
        for k in range(40):
            begin_ns = START_NS + k * period_ns
            clock.publish(Clock(clock=time_message(begin_ns + period_ns)))
            running.spin_until(lambda at_ns=begin_ns + period_ns: now_ns(running) == at_ns)
            stamp_ns = begin_ns + (moved_ns if k >= 30 else 0)
            scan = replace(log.scans[0], stamp_ns=stamp_ns, geometry=geometry)
            running.send(running.scans, scan_message(scan))
            running.spin_until(lambda count=k + 1: len(heard) == count)
            assert k >= 30 or not warned(running)
        running.spin_until(lambda: warned(running))


def test_scans_of_a_second_publisher_are_dropped_counted_and_warned_of(log):
    log = replace(log, scans=log.scans[:-3])
    expected, _ = assemble_log(log, PipelineConfig())
    with bench('deadline:=10.0') as running:
        other = running.feeder.create_publisher(LaserScan, 'scan', 10)
        running.spin_until_heard(other)
        near = [replace(scan, ranges=scan.ranges / 2) for scan in log.scans[1:]]
        others = [(scan.stamp_ns + SCAN_NS + 1, other, scan_message(scan)) for scan in near]
        running.feed(log, others)
        clouds = running.out[PointCloud2]
        running.spin_until(lambda: len(clouds) >= len(expected))
        running.spin_until(lambda: running.node.scans.of_others == len(others))
        second = 'dropped: scan of a second publisher'
        running.spin_until(lambda: any(second in text for text in texts(running)))
    for cloud, points in zip(clouds, expected, strict=True):
        assert bytes(cloud.data) == points.data.tobytes()


@pytest.mark.parametrize('is_first', [True, False])
def test_no_cloud_is_made_of_the_joint_states_of_two_publishers(log, is_first):
    """As of a joint_state_publisher, which has every joint of the model at 0, at 20 Hz."""
    later_ns = 0 if is_first else 1_000_000_000
    log = replace(log, scans=log.scans[:-3])
    expected, _ = assemble_log(log, PipelineConfig())
    with bench('deadline:=10.0') as running:
        other = running.feeder.create_publisher(JointState, 'joint_states', 50)
        running.spin_until_heard(other)
        begin_ns, end_ns = log.sample_ns[0] + later_ns, log.sample_ns[-1]
        for _ in range(5):  # two that count alike could be taken for each other
            running.send(other, JointState(name=['wheel'], position=[0.0]))
        others = [
            (at, other, state_message(at, 0.0))
            for at in range(begin_ns - 1_000_000, end_ns, 50_000_000)
        ]
        running.feed(log, others)
        drops = running.node.assembly.assembler.drops
        running.spin_until(lambda: drops[SEVERAL] > 100)
        running.spin_until(lambda: any(SEVERAL in text for text in texts(running)))
        assert any("2 publishers of 'nod_joint'" in text for text in texts(running))
        clouds = running.out[PointCloud2]
    # Those from before it was noticed, of which one may have a joint state of the other publisher.
    most = later_ns / 1e8 + 1
    assert len(clouds) <= most
    for cloud, points in zip(clouds[:-1], expected, strict=False):
        assert bytes(cloud.data) == points.data.tobytes()


def test_a_joint_that_stands_still_in_a_commanded_nod_is_warned_of(log):
    still = replace(log, sample_pitch=np.zeros(len(log.sample_ns)))
    with bench('samples_per_sweep:=4001') as running:
        running.feed(still)
        running.spin_until(lambda: any('although a nod is commanded' in t for t in texts(running)))


def test_stamps_that_drift_are_named(log, monkeypatch):
    # Of short windows, the least delay scatters by as much as the host delays messages.
    monkeypatch.setattr(stamp_drift, 'WINDOW_NS', 300_000_000)
    monkeypatch.setattr(stamp_drift, 'MOST_NS', 300_000_000)
    later_ns = 0
    with bench() as running:

        def send():
            now_ns = time.time_ns()
            running.states.publish(state_message(now_ns, 0.1))
            scan = replace(log.scans[0], stamp_ns=now_ns - SCAN_NS + later_ns)
            running.scans.publish(scan_message(scan))

        running.feeder.create_timer(0.05, send)
        running.spin_until(lambda: running.node.diagnosis._drift._first_ns)
        later_ns = 800_000_000
        drifted = 'stamps of scans drifted: they are'
        running.spin_until(lambda: any(drifted in text for text in texts(running)))


@pytest.mark.parametrize(('ahead', 'is_named'), [(0.05, False), (5.0, True)])
def test_joint_states_of_a_clock_that_is_ahead_are_named(ahead, is_named):
    with bench() as running:
        joints, diagnosis = running.node.assembly.assembler.joint, running.node.diagnosis
        running.spin_until(lambda: running.node.count_publishers('joint_states'))
        stamp_ns = running.node.get_clock().now().nanoseconds + round(ahead * 1e9)
        for at in (stamp_ns, stamp_ns + 1):
            running.states.publish(state_message(at, 0.0))
        running.spin_until(lambda: not joints.missing_input)
        found = [text for text in diagnosis._warnings() if 'in the future' in text]
    assert [text.startswith("'nod_joint' is stamped ") for text in found] == [True] * is_named


@pytest.mark.parametrize(
    ('early', 'text'),
    [
        (-0.4, 'the end of each scan is stamped 0.4'),
        (0.6, 'scans come 0.6'),
        (0.1, ''),
        (-0.0666, 'scans come 0.0'),  # stamped at their end
        (-0.02, ''),
    ],
)
def test_scans_of_another_clock_are_named_from_the_start(log, monkeypatch, early, text):
    """Joint states come at once; scans are stamped too early or too late."""
    monkeypatch.setattr(stamp_drift, 'WINDOW_NS', NS_PER_S)
    with bench() as running:
        drift = running.node.diagnosis._drift

        def send():
            now_ns = time.time_ns()
            running.states.publish(state_message(now_ns, 0.1))
            stamp_ns = now_ns - SCAN_NS - round(early * NS_PER_S)
            running.scans.publish(scan_message(replace(log.scans[0], stamp_ns=stamp_ns)))

        running.feeder.create_timer(0.05, send)
        running.spin_until(lambda: drift._apart_ns)
        found = [each for each in running.node.diagnosis._warnings() if 'clocks' in each]
        assert [each[: len(text)] for each in found] == ([text] if text else [])


def test_scans_of_which_none_can_be_placed_are_an_error(log, monkeypatch):
    monkeypatch.setattr(diagnosis, '_UNPLACED', 0.5)
    with bench('deadline:=0.1') as running:

        def send():
            now_ns = time.time_ns()
            running.states.publish(state_message(now_ns - 5 * NS_PER_S, 0.1))
            stamp_ns = now_ns - SCAN_NS
            running.scans.publish(scan_message(replace(log.scans[0], stamp_ns=stamp_ns)))

        running.feeder.create_timer(0.05, send)
        silent = running.node.diagnosis._silent
        running.spin_until(lambda: any('no scan was placed for' in each for each in silent()))


def test_scans_that_come_but_are_refused_are_not_called_missing(log):
    with bench() as running:
        speed = 1.0

        def send():
            scan = scan_message(replace(log.scans[0], stamp_ns=time.time_ns() - SCAN_NS))
            scan.time_increment *= speed
            running.scans.publish(scan)

        running.feeder.create_timer(0.1, send)
        running.spin_until(lambda: running.node.diagnosis.counts['scans'] > 40)
        speed = 1.5  # of which some are refused, until they are the usual ones
        silent = running.node.diagnosis._silent
        running.spin_until(lambda: any('no usable scan for' in each for each in silent()))


def test_points_of_an_interval_are_those_of_the_clouds_within_it(log):
    parameters = 'deadline:=10.0', 'scan_memory:=1.5'
    with bench(*parameters) as running:
        client = running.feeder.create_client(AssembleScans, 'assembler/assemble_scans')
        running.spin_until(client.service_is_ready)

        def ask(begin, end):
            request = AssembleScans.Request(begin=begin, end=end)
            future = client.call_async(request)
            running.spin_until(future.done)
            return future.result()

        running.feed(log)
        running.spin_until(lambda: len(running.out[PointCloud2]) >= len(log.scans) - 1)
        clouds = running.out[PointCloud2][:]
        first, last = clouds[-8].header.stamp, clouds[-4].header.stamp
        found, old = ask(first, last), ask(clouds[0].header.stamp, last)
        turned, none = ask(last, first), ask(Time(sec=2**31 - 1), Time())
    assert found.success, found.message
    assert (found.cloud.header.frame_id, found.cloud.header.stamp) == ('nodlidar_base_link', first)
    expected = np.concatenate([point_cloud2.read_points(cloud) for cloud in clouds[-8:-3]])
    expected = expected[: found.cloud.width]  # of the last scan only the first point
    assert found.cloud.width == sum(cloud.width for cloud in clouds[-8:-4]) + 1
    got = point_cloud2.read_points(found.cloud)
    for name in ('x', 'y', 'z', 'intensity'):
        np.testing.assert_array_equal(got[name], expected[name])
    assert got['ring'].max() == 4
    assert not old.success
    assert "'begin' must be after" in old.message
    assert not turned.success
    assert "'end' must be at least begin" in turned.message
    assert (none.success, none.cloud.width) == (True, 0)
    assert none.cloud.header.frame_id == 'nodlidar_base_link'


def test_all_requests_that_come_at_once_are_answered():
    with bench() as running:
        client = running.feeder.create_client(AssembleScans, 'assembler/assemble_scans')
        running.spin_until(client.service_is_ready)
        sent = [client.call_async(AssembleScans.Request()) for _ in range(50)]
        running.spin_until(lambda: all(future.done() for future in sent))
    assert {future.result().message for future in sent} == {'no points'}


@pytest.mark.parametrize(('jitter_ms', 'named'), [(0.0, False), (1.0, False), (12.0, True)])
def test_scans_whose_stamps_jitter_are_named(log, jitter_ms, named):
    off = np.random.default_rng(2).normal(0.0, jitter_ms * 1e6, len(log.scans))
    scans = [
        replace(scan, stamp_ns=scan.stamp_ns + round(late))
        for scan, late in zip(log.scans, off, strict=True)
    ]
    with bench() as running:
        running.feed(replace(log, scans=scans))
        running.spin_until(lambda: len(running.out[PointCloud2]) >= len(log.scans) // 2)
        jitter = [text for text in running.node.diagnosis._warnings() if 'jitter by' in text]
    assert bool(jitter) is named


@pytest.mark.parametrize(('jitter_ms', 'named'), [(0.0, False), (0.5, False), (3.0, True)])
def test_joint_states_whose_stamps_jitter_are_named(log, jitter_ms, named):
    off = np.random.default_rng(2).normal(0.0, jitter_ms * 1e6, len(log.sample_ns))
    jittering = replace(log, sample_ns=log.sample_ns + np.rint(off).astype(np.int64))
    with bench() as running:
        running.feed(jittering)
        running.spin_until(lambda: len(running.out[PointCloud2]) >= len(log.scans) // 2)
        scatter = [text for text in running.node.diagnosis._warnings() if 'scatter by' in text]
    assert bool(scatter) is named


def test_where_simulated_time_begins_late_no_scan_is_lost_and_no_command_in_the_future(log):
    stamp_ns = log.scans[20].stamp_ns
    early = log.sample_ns <= stamp_ns
    before = SensorLog(log.scans[:20], log.sample_ns[early], log.sample_pitch[early])
    after = SensorLog(log.scans[20:], log.sample_ns[~early], log.sample_pitch[~early])
    with bench('use_sim_time:=true') as running:
        clock = running.feeder.create_publisher(Clock, '/clock', 10)
        running.spin_until_heard(clock)
        running.feed(before)
        running.spin_until(lambda: running.node.diagnosis.counts['scans'] == 20)
        commanded = len(running.out[NodCommand])
        clock.publish(Clock(clock=time_message(stamp_ns)))
        running.spin_until(lambda: running.node.get_clock().now().nanoseconds)
        running.feed(after)
        running.spin_until(lambda: len(running.out[NodCommand]) > commanded + 1)
        drops = running.node.assembly.assembler.drops
        counts = running.node.diagnosis.counts
        running.spin_until(lambda: counts['clouds'] + drops.total() >= len(log.scans) - 1)
        assert not running.node.survival.errors
    stamps_ns = [time_ns(command.header.stamp) for command in running.out[NodCommand]]
    assert max(stamps_ns) <= stamp_ns + SCAN_NS
    assert stamps_ns[-1] == stamp_ns
