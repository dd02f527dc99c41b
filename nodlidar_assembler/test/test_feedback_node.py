"""The assembler node chooses sweep after sweep, in the time of the data."""

from dataclasses import replace
import itertools
import re
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from log_messages import scan_message
from node_bench import bench, LONGEST
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_common.ros.messages import nod_from_message, time_message
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
    with bench('nod_mode:=feedback', 'samples_per_sweep:=4001', 'use_sim_time:=true') as running:
        feed_in_time(running, log)
        commands = running.out[NodCommand]
        running.spin_until(lambda: len({time_ns(c.start_time) for c in commands}) >= 5)
    chosen = {time_ns(c.start_time): nod_from_message(c) for c in commands}
    (_, nod), *later = sorted(chosen.items())[1:]  # without that planned before any was chosen
    for start_ns, following in later:
        assert following.pitch(start_ns) == pytest.approx(float(nod.pitch(start_ns)), abs=1e-3)
        assert abs(following.samples_per_sweep / 4001 - 1.0) < 0.16
        nod = following
    assert len({nod.samples_per_sweep for nod in chosen.values()}) > 2
    assert {(nod.pitch_min, nod.pitch_max) for nod in chosen.values()} == {(-0.6136, 0.6136)}


def test_without_scans_commands_stop_although_the_clock_stands_still(log):
    """And the diagnostics tell that none comes."""

    def silence():
        statuses = [s for array in running.out[DiagnosticArray] for s in array.status]
        errors = [s.message for s in statuses if s.level == DiagnosticStatus.ERROR]
        found = [re.search(r'no scan for ([0-9.]+) s', message) for message in errors]
        return max((float(match[1]) for match in found if match), default=0.0)

    with bench('use_sim_time:=true', 'scan_timeout:=0.5') as running:
        running.feed(log)
        running.spin_until(lambda: silence() > 1.0)
        commands = len(running.out[NodCommand])
        running.spin_until(lambda: silence() > 3.0)
        statuses = [s for array in running.out[DiagnosticArray] for s in array.status]
        assert any('/clock has stood still for' in status.message for status in statuses)
    assert commands > 0
    assert len(running.out[NodCommand]) == commands


def test_in_a_slow_simulation_no_input_is_silent_before_its_second_message(log):
    def silent(running):
        statuses = [s for array in running.out[DiagnosticArray] for s in array.status]
        return [s.message for s in statuses if 'no scan for' in s.message]

    with bench('use_sim_time:=true') as running:
        running.feed(replace(log, scans=log.scans[:1]))
        begin = time.monotonic()
        running.spin_until(lambda: time.monotonic() - begin > 1.0)
        assert not silent(running)
        running.feed(replace(log, scans=log.scans[1:2]))
        running.spin_until(lambda: silent(running))


def test_while_scans_come_commands_go_on_although_the_clock_stands_still(log):
    with bench('use_sim_time:=true', 'command_rate:=20.0') as running:
        scans = itertools.cycle(map(scan_message, log.scans))
        deadline = time.monotonic() + LONGEST
        while len(running.out[NodCommand]) < 10:
            assert time.monotonic() < deadline
            running.scans.publish(next(scans))
            running.executor.spin_once(timeout_sec=0.05)
