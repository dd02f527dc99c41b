"""Which nod is commanded, in either mode."""

from copy import deepcopy
from dataclasses import replace
import itertools
import math

from assembling import assembled_of
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.phase_lock import PhaseLock
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

STEP = math.tau / 1024
URG = ScanGeometry(682, -340 * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
BEAMS = Beams(URG, REFERENCE_LASER_POSE)
BEGIN_NS = 1_700_000_000_000_000_000
PERIOD_NS = 100_000_000
LATER_NS = int(BEAMS.offset_ns[-1]) + 40_000_000


def run(controller, scans, first=0, since_ns=BEGIN_NS, beams=BEAMS):
    """Let scans come, of a servo that is on the commanded nod; return the commands."""
    commands, geometry = [], beams.geometry
    for number in range(first, first + scans):
        begin_ns = since_ns + number * PERIOD_NS
        controller.add_scan(geometry, begin_ns)
        nod, _ = controller.command
        pitch = nod.pitch(begin_ns + beams.offset_ns)
        controller.add_beams(begin_ns, beams, pitch, begin_ns + LATER_NS)
        commands.append(controller.command)
    return commands


def test_before_the_first_scan_there_is_no_command():
    assert NodController(AssemblerConfig(samples_per_sweep=4001)).command is None


def test_coprime_is_the_nod_that_is_tied_to_the_lidar():
    commands = run(NodController(AssemblerConfig(samples_per_sweep=4001)), 20)
    lock = PhaseLock(NodShape(-0.6136, 0.6136, 4001), 1024)
    for number, (nod, start_ns) in enumerate(commands):
        lock.add_scan(URG, BEGIN_NS + number * 100_000_000)
        assert nod == lock.nod
        assert start_ns == 0


def test_feedback_commands_one_sweep_after_the_other():
    commands = run(NodController(AssemblerConfig(nod_mode='feedback', samples_per_sweep=4001)), 60)
    starts = [start_ns for _, start_ns in commands]
    assert starts == sorted(starts)
    assert 12 <= len(set(starts)) <= 18  # 6 s of sweeps of 0.39 s
    assert len({nod.samples_per_sweep for nod, _ in commands}) > 5


def test_another_shape_goes_on_from_the_sweep_that_was_chosen():
    controller = NodController(AssemblerConfig(nod_mode='feedback', samples_per_sweep=4001))
    run(controller, 43)
    before, start_ns = controller.command
    now_ns = max(start_ns, BEGIN_NS + 42 * 100_000_000 + LATER_NS)
    pitch = float(before.pitch(now_ns))
    assert controller.change(NodShape(-0.5, 0.7, 3001), now_ns)
    after, start_ns = controller.command
    assert (after.pitch_min, after.pitch_max, after.samples_per_sweep) == (-0.5, 0.7, 3001)
    assert start_ns == 0
    assert float(after.pitch(now_ns)) == pytest.approx(np.clip(pitch, -0.5, 0.7), abs=2e-3)
    chosen = run(controller, 30, first=43)
    assert {(nod.pitch_min, nod.pitch_max) for nod, _ in chosen} == {(-0.5, 0.7)}
    assert len({nod.samples_per_sweep for nod, _ in chosen}) > 3


def test_the_same_shape_changes_nothing():
    controller = NodController(AssemblerConfig(nod_mode='feedback', samples_per_sweep=4001))
    run(controller, 20)
    command = controller.command
    assert not controller.change(NodShape(-0.6136, 0.6136, 4001), BEGIN_NS + 2_000_000_000)
    assert controller.command == command


@pytest.mark.parametrize('back', [30, 3600])
def test_sweeps_are_chosen_again_after_the_clock_was_set_back(back):
    """What was chosen is for a time that is far ahead by then."""
    controller = NodController(AssemblerConfig(nod_mode='feedback', samples_per_sweep=4001))
    run(controller, 43)
    begin_ns = BEGIN_NS - back * 1_000_000_000
    commands = run(controller, 60, since_ns=begin_ns)
    settled = {start_ns for _, start_ns in commands[10:]}
    assert 11 <= len(settled) <= 17  # 5 s of sweeps of 0.39 s
    ahead_ns = 190_000_000  # at most, of the next sweep
    assert max(settled) <= begin_ns + 59 * PERIOD_NS + LATER_NS + ahead_ns


def test_another_shape_goes_on_from_the_sweep_that_is_under_way():
    """The one that was chosen does not count before its start."""
    controller = NodController(AssemblerConfig(nod_mode='feedback', samples_per_sweep=4001))
    ((under_way, _),) = run(controller, 1)
    jumps = []
    for number in range(1, 60):
        now_ns = BEGIN_NS + number * PERIOD_NS + LATER_NS
        ((after, start_ns),) = run(controller, 1, first=number)
        if start_ns > now_ns:
            changed = deepcopy(controller)
            assert changed.change(NodShape(-0.6, 0.6, 4001), now_ns)
            jumps.append(float(changed.command[0].pitch(now_ns) - under_way.pitch(now_ns)))
        else:
            under_way = after
    assert len(jumps) > 10
    assert max(map(abs, jumps)) < 0.015  # by as much as the limits have come nearer


def test_cells_that_no_step_sees_are_not_waited_for():
    """At 4 degrees from step to step, of columns of 2.9 degrees some have none."""
    step = math.tau / 90
    coarse = ScanGeometry(60, -30 * step, step, 0.1 / 90, 0.02, 5.6)
    controller = NodController(
        AssemblerConfig(nod_mode='feedback', steps_per_revolution=90, samples_per_sweep=353)
    )
    run(controller, 300, beams=Beams(coarse, REFERENCE_LASER_POSE))
    assert controller.round_time < 20.0


def test_interlaced_commands_the_sweeps_of_the_schedule_in_turn():
    """Each slow sweep up is followed by a fast return; together they take whole revolutions."""
    config = AssemblerConfig(nod_mode='interlaced', samples_per_sweep=12001)
    commands = {start_ns: nod for nod, start_ns in run(NodController(config), 150)}
    begun = sorted(commands)[1:]
    upward = [float(commands[start].velocity(start + 1000)) > 0.0 for start in begun]
    assert all(up != after for up, after in itertools.pairwise(upward))
    taken = [commands[start].samples_per_sweep for start in begun]
    least = 1.2272 / (config.max_nod_speed * 0.1 / 1024)
    for up, samples in zip(upward, taken, strict=True):
        assert least <= samples <= 12001
        assert (samples > 8000) == up
    first = upward.index(True)
    assert sum(taken[first : first + 8]) % 1024 == 0


def test_interlaced_needs_time_for_its_sweeps():
    controller = NodController(AssemblerConfig(nod_mode='interlaced', samples_per_sweep=1501))
    with pytest.raises(ParameterError, match='most_samples'):
        run(controller, 1)
    assert controller.command[0].samples_per_sweep == 1501


def test_interlaced_does_not_mind_a_lidar_that_turns_to_the_right():
    config = AssemblerConfig(nod_mode='interlaced', samples_per_sweep=12001)
    controller = NodController(config)
    geometry = replace(URG, angle_min=-URG.angle_min, angle_increment=-STEP)
    mirrored = Beams(geometry, REFERENCE_LASER_POSE)
    assert len({start for _, start in run(controller, 60, beams=mirrored)}) > 5


def test_a_lidar_that_sweeps_cannot_be_chosen_for_keeps_the_nod_in_its_phase():
    reversed_urg = ScanGeometry(682, 340 * STEP, -STEP, 0.1 / 1024, 0.02, 5.6)
    controller = NodController(AssemblerConfig(nod_mode='feedback', samples_per_sweep=4001))
    lock = PhaseLock(NodShape(-0.6136, 0.6136, 4001), 1024)
    for number in range(20):  # whose clock is 100 ppm slow
        with pytest.raises(ParameterError, match='angle_increment'):
            run(
                controller,
                1,
                since_ns=BEGIN_NS + number * 100_010_000,
                beams=Beams(reversed_urg, REFERENCE_LASER_POSE),
            )
        lock.add_scan(reversed_urg, BEGIN_NS + number * 100_010_000)
        assert controller.command == (lock.nod, 0)


@pytest.mark.parametrize('mode', ['coprime', 'feedback', 'interlaced'])
def test_another_plan_goes_on_from_the_present_pitch(mode):
    controller = NodController(AssemblerConfig(samples_per_sweep=4001))
    run(controller, 23)
    now_ns = BEGIN_NS + 23 * PERIOD_NS
    before, _ = controller.command
    other = AssemblerConfig(pitch_min=-0.7, samples_per_sweep=6003, nod_mode=mode)
    controller.reconfigure(other, now_ns)
    after, _ = controller.command
    assert (after.pitch_min, after.samples_per_sweep) == (-0.7, 6003)
    pitch = [float(nod.pitch(np.array([now_ns]))[0]) for nod in (before, after)]
    sample = after.span / 6003
    assert abs(pitch[0] - pitch[1]) <= 2.0 * sample
    commands = run(controller, 60, first=24)
    assert len({nod.samples_per_sweep for nod, _ in commands}) > 1 or mode == 'coprime'


def test_a_plan_before_the_first_scan_is_that_of_the_first_scan():
    controller = NodController(AssemblerConfig(samples_per_sweep=4001))
    controller.reconfigure(AssemblerConfig(samples_per_sweep=6003), BEGIN_NS)
    assert controller.command is None
    assert run(controller, 1)[0][0].samples_per_sweep == 6003


def test_another_lidar_has_its_own_rate_from_the_first_scan_on():
    """The nod was four times as fast until the revolutions of the new one were known."""
    ust = ScanGeometry(1081, -135 * math.tau / 360, math.tau / 1440, 0.025 / 1440, 0.06, 10.0)
    controller, begin_ns = NodController(AssemblerConfig()), BEGIN_NS
    for geometry, period_ns in ((ust, 25_000_000), (URG, 100_000_000)):
        for _ in range(30):
            begin_ns += period_ns
            controller.add_scan(geometry, begin_ns)
            nod, _ = controller.command
            assert nod.speed == pytest.approx(controller.view.config.task.span / 0.737, rel=1e-3)
            steps = nod.samples_per_sweep / nod.sweep_duration * period_ns * 1e-9
            assert steps == pytest.approx(controller.view.config.steps_per_revolution, rel=1e-3)


def test_a_plan_is_for_the_lidar_that_was_seen():
    other = replace(URG, beams=360, angle_min=-math.pi, angle_increment=math.tau / 360)
    controller = NodController(AssemblerConfig(samples_per_sweep=4001))
    run(controller, 3, beams=Beams(other, REFERENCE_LASER_POSE))
    controller.reconfigure(AssemblerConfig(samples_per_sweep=6003), BEGIN_NS + 3 * PERIOD_NS)
    assert controller.view.config.steps_per_revolution == 360
    assert math.gcd(controller.planned.samples_per_sweep, 360) == 1


def test_after_a_plan_the_nod_is_clocked_by_the_steps_that_it_is_coprime_with():
    """An LD19, whose beams per revolution drift, and a live parameter."""
    controller = NodController(AssemblerConfig())
    for beams in (450, 465):
        step = math.tau / beams
        other = ScanGeometry(beams, 0.0, step, 0.1 / beams, 0.02, 12.0)
        run(controller, 3, beams=Beams(other, REFERENCE_LASER_POSE))
    controller.reconfigure(AssemblerConfig(pitch_max=0.4), BEGIN_NS + 3 * PERIOD_NS)
    run(controller, 3, 4, beams=Beams(other, REFERENCE_LASER_POSE))
    nod, _ = controller.command
    steps = controller.view.config.steps_per_revolution
    assert math.gcd(nod.samples_per_sweep, steps) == 1
    assert nod.sweep_duration == pytest.approx(nod.samples_per_sweep * 0.1 / steps)


def test_limits_follow_the_range_while_configured_until_the_clock_is_set():
    """A wall is 2 m away in all directions."""
    config = AssemblerConfig(samples_per_sweep=4001, adapt_limits=True)
    controller = NodController(config)
    fixed = controller.planned

    def follow(number, step_ns=0):
        begin_ns = BEGIN_NS + number * PERIOD_NS + step_ns
        controller.add_scan(URG, begin_ns)
        pitch = controller.command[0].pitch(begin_ns + BEAMS.offset_ns)
        scan = Scan(begin_ns, URG, np.full(URG.beams, 2.0, np.float32))
        seen = assembled_of(scan, BEAMS, pitch)
        controller.follow_range(seen, None, begin_ns + LATER_NS)
        return controller.shape

    for number in range(30):
        shape = follow(number)
    assert shape.pitch_max < 0.5 < fixed.pitch_max
    controller.shift(5 * PERIOD_NS)
    assert follow(30, 5 * PERIOD_NS).pitch_max == fixed.pitch_max
    for number in range(31, 60):
        shape = follow(number, 5 * PERIOD_NS)
    assert shape.pitch_max < 0.5
    controller.configure_limits(replace(config, adapt_limits=False))
    assert follow(60, 5 * PERIOD_NS) == fixed
