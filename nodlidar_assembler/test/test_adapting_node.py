"""The assembler node adapts the nod to what its scans show, while told to."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_bench import bench
from nodlidar_assembler.control.adapted_shape import BAND
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimitsConfig
from nodlidar_common.ros.messages import nod_from_message
from nodlidar_msgs.msg import Coverage, NodCommand
from nodlidar_planner.pattern.task import Task
import pytest
from rclpy.parameter import Parameter
from test_assembler_node import log

__all__ = ['log']

STALE = DiagnosticStatus.STALE
FIXED = (-0.6136, 0.6136)


def limits_of(command):
    nod = nod_from_message(command)
    return nod.pitch_min, nod.pitch_max


def test_limits_follow_the_wall_from_one_command_to_the_next(log):
    """The wall is 2 m ahead; half of the sector is 30 degrees, so the median is at 15."""
    with bench('samples_per_sweep:=4001', 'adapt_limits:=true', 'limits_rate:=0.5') as running:
        running.feed(log)
        commands = running.out[NodCommand]
        expected = pytest.approx(limits_at(PitchLimitsConfig(), 2.0 / 0.9659), abs=0.02)
        running.spin_until(lambda: commands and limits_of(commands[-1]) == expected)
    assert limits_of(commands[0]) == FIXED
    assert all(-0.6136 <= low < high <= 0.6136 for low, high in map(limits_of, commands))
    chosen = [command.samples_per_sweep for command in commands]
    assert all(4001 / BAND <= n_s <= 4001 * BAND and n_s % 2 == 1 for n_s in chosen)
    # Once for the mount's limits, once for the wall's, and the planned one before any scan.
    assert len(set(chosen)) <= 3


def test_it_can_be_turned_on_and_off_while_the_node_runs(log):
    half = len(log.scans) // 2
    with bench() as running:
        running.feed(part(log, slice(None, half)))
        commands = running.out[NodCommand]
        running.spin_until(lambda: len(commands) >= 3)
        assert {limits_of(command) for command in commands} == {FIXED}
        running.node.set_parameters([Parameter('adapt_limits', value=True)])
        running.feed(part(log, slice(half, -4)))
        running.spin_until(lambda: limits_of(commands[-1]) != FIXED)
        running.node.set_parameters([Parameter('adapt_limits', value=False)])
        running.feed(part(log, slice(-4, None)))
        running.spin_until(lambda: limits_of(commands[-1]) == FIXED)


def test_another_nod_can_be_planned_while_the_node_runs(log):
    half = len(log.scans) // 2
    with bench('samples_per_sweep:=4001') as running:
        running.feed(part(log, slice(None, half)))
        commands = running.out[NodCommand]
        running.spin_until(lambda: len(commands) >= 3)
        wrong = running.node.set_parameters([Parameter('pitch_min', value=1.0)])
        assert not wrong[0].successful
        assert 'pitch_max' in wrong[0].reason
        other = {'pitch_min': -0.2, 'pitch_max': 0.3, 'samples_per_sweep': 3001}
        chosen = [Parameter(name, value=value) for name, value in other.items()]
        assert running.node.set_parameters_atomically(chosen).successful
        running.feed(part(log, slice(half, None)))
        running.spin_until(lambda: limits_of(commands[-1]) == (-0.2, 0.3))
        assert commands[-1].samples_per_sweep == 3001


def part(log, chosen):
    """Return some scans, and the joint samples from the first of them on till after the last."""
    scans = log.scans[chosen]
    first, last = scans[0].stamp_ns - 40_000_000, scans[-1].stamp_ns + 99_000_000
    within = (log.sample_ns >= first) & (log.sample_ns <= last)
    return type(log)(scans, log.sample_ns[within], log.sample_pitch[within])


def test_coverage_is_told_in_the_diagnostics(log):
    """In 3 s the nod sees five cells out of six, and leaves holes of a cell or two."""

    def reported(running):
        statuses = [s for array in running.out[DiagnosticArray] for s in array.status]
        values = [{v.key: v.value for v in s.values} for s in statuses if 'coverage' in s.name]
        return [v for v in values if int(v['beams']) >= 25 * 681]

    with bench() as running:
        running.feed(log)
        running.spin_until(lambda: reported(running))
        values = reported(running)[-1]
    assert float(values['share of cells seen']) == pytest.approx(5 / 6, abs=0.1)
    assert float(values['largest hole [rad]']) < 0.16
    assert float(values['share of repeats']) < 0.05


def test_coverage_is_published_of_cells_as_large_as_told(log):
    with bench('object_size:=0.2') as running:
        running.feed(log)
        messages = running.out[Coverage]
        running.spin_until(lambda: messages and messages[-1].beams >= 25 * 681)
    coverage = messages[-1]
    task = Task(object_size=0.2)
    assert (coverage.window, coverage.cell, coverage.cells) == (10.0, task.cell, task.cells)
    assert coverage.header.frame_id == 'nodlidar_base_link'
    assert coverage.seen == pytest.approx(5 / 6, abs=0.1)
    assert coverage.largest_hole <= task.span
    assert coverage.least_repeats == 0.0
    assert 0.0 <= coverage.repeats < 0.05


def test_coverage_is_not_told_again_when_no_beams_come(log):
    with bench() as running:
        running.feed(log)
        messages, diagnostics = running.out[Coverage], running.out[DiagnosticArray]

        def stale():
            statuses = [status for array in diagnostics for status in array.status]
            return [s for s in statuses if 'coverage' in s.name and s.level == STALE]

        running.spin_until(lambda: messages and messages[-1].beams >= 25 * 681)
        before = len(stale())
        running.spin_until(lambda: len(stale()) >= before + 3)
    beams = [message.beams for message in messages]
    assert beams == sorted(set(beams))  # each time more


def test_without_a_window_coverage_is_not_told(log):
    with bench('coverage_window:=0.0') as running:
        running.feed(log)
        diagnostics = running.out[DiagnosticArray]
        running.spin_until(lambda: diagnostics)
    names = {status.name for array in diagnostics for status in array.status}
    assert any('clouds' in name for name in names)
    assert not any('coverage' in name for name in names)
    assert not running.out[Coverage]
