"""The assembler node chooses sweep after sweep, in the time of the data."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_bench import bench
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_common.messages import nod_from_message, time_message
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from test_assembler_node import log

__all__ = ['log']

LATER_NS = 120_000_000  # a scan is assembled so long after its first beam


def feed_in_time(running, log):
    """Feed scan by scan, each with the joint samples by then, on a clock that goes along."""
    clock = running.feeder.create_publisher(Clock, '/clock', 10)
    clouds = running.out[PointCloud2]
    for last, scan in zip([None, *log.scans], log.scans, strict=False):
        from_ns = -1 if last is None else last.stamp_ns + LATER_NS
        now_ns = scan.stamp_ns + LATER_NS
        new = (log.sample_ns > from_ns) & (log.sample_ns <= now_ns)
        clock.publish(Clock(clock=time_message(now_ns)))
        running.spin_until(lambda at=now_ns: running.node.get_clock().now().nanoseconds >= at)
        before = len(clouds)
        running.feed(SensorLog([scan], log.sample_ns[new], log.sample_pitch[new]))
        running.spin_until(lambda count=before: len(clouds) > count)


def test_sweeps_follow_each_other_as_chosen(log):
    """Each command is for later, from a turn of the one before on, near to the planned N_s."""
    with bench('nod_mode:=feedback', 'use_sim_time:=true') as running:
        feed_in_time(running, log)
        commands = running.out[NodCommand]
        running.spin_until(lambda: len({time_ns(c.start_time) for c in commands}) >= 5)
    chosen = {time_ns(c.start_time): nod_from_message(c) for c in commands}
    (_, nod), *later = sorted(chosen.items())
    for start_ns, following in later[1:]:
        assert following.pitch(start_ns) == pytest.approx(float(nod.pitch(start_ns)), abs=1e-3)
        assert abs(following.samples_per_sweep / 4001 - 1.0) < 0.16
        nod = following
    assert len({nod.samples_per_sweep for nod in chosen.values()}) > 2
    assert {(nod.pitch_min, nod.pitch_max) for nod in chosen.values()} == {(-0.6136, 0.6136)}


def test_without_scans_commands_stop_also_after_the_clock_was_set_back(log):
    """And the diagnostics tell that none comes."""

    def told():
        statuses = [s for array in running.out[DiagnosticArray] for s in array.status]
        return [(s.level, s.message) for s in statuses if 'clouds' in s.name]

    with bench('use_sim_time:=true') as running:
        clock, commands = running.feeder.create_publisher(Clock, '/clock', 10), []

        def set_to(now_ns):
            clock.publish(Clock(clock=time_message(now_ns)))
            running.spin_until(lambda: running.node.get_clock().now().nanoseconds == now_ns)
            commands.append(len(running.out[NodCommand]))

        begin_ns = log.scans[0].stamp_ns
        set_to(begin_ns)
        running.feed(log)
        running.spin_until(lambda: running.out[NodCommand])
        for later in range(60):  # 6 s, an hour before; scans are missed after 2 s
            set_to(begin_ns - 3600 * NS_PER_S + later * 100_000_000)
        running.spin_until(lambda: told()[-1][0] != DiagnosticStatus.OK)
    assert commands[30] == commands[-1]
    assert told()[-1] == (DiagnosticStatus.ERROR, 'no scan since the clock was set back')
