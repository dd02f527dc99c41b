"""Sweep after sweep chosen, with the lidar's clock and a servo that turns a little off."""

import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.control.chosen_sweeps import ChosenSweeps
from nodlidar_assembler.inputs.revolutions import Revolutions
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.coverage.lower_bound import lower_bound
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.feedback import SPREAD
import numpy as np
import pytest

STEP = math.tau / 1024
URG = ScanGeometry(682, -340 * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
AZIMUTH = URG.angle_min + STEP * np.arange(682)
T_S = 0.1 / 1024
TASK = Task()
BEGIN_NS = 1_700_000_000 * NS_PER_S
PLANNED = Nod(TASK.pitch_min, TASK.pitch_max, 2501 * T_S, 2501, BEGIN_NS)


class Servo:
    """Turns at the commanded instants but for an error, and goes steadily between them."""

    def __init__(self, sweeps, error=0.0, chosen=True, notice=0.05):
        self.sweeps = sweeps
        self.nods = [(BEGIN_NS, PLANNED)]
        self._error, self._chosen, self._notice = error, chosen, notice
        self._lidar, self._noise = Revolutions(), np.random.default_rng(1)
        self._commanded, self._turned = [BEGIN_NS], [BEGIN_NS]

    def scan(self, number):
        begin_ns = BEGIN_NS + number * 100_000_000
        self._lidar.add(begin_ns, 0.1)
        times = begin_ns + np.rint(np.arange(682) * T_S * NS_PER_S).astype(np.int64)
        self.sweeps.add_beams(times, AZIMUTH, self._pitch(times))
        now_ns = int(times[-1]) + round(self._notice * NS_PER_S)
        if self._chosen and self.sweeps.choose(now_ns, self._lidar, URG):
            self.nods.append((self.sweeps.start_ns, self.sweeps.nod))

    def _pitch(self, times):
        while self._turned[-1] <= times[-1]:
            self._turn()
        turned = (np.array(self._turned) - BEGIN_NS) / NS_PER_S
        limits = np.resize([TASK.pitch_min, TASK.pitch_max], len(turned))
        return np.interp((times - BEGIN_NS) / NS_PER_S, turned, limits)

    def _turn(self):
        """Add the turn that ends the present sweep."""
        begin_ns = self._commanded[-1]
        nod = [nod for start_ns, nod in self.nods if start_ns <= begin_ns][-1]
        leg = round(float(nod.sweeps(begin_ns)))
        assert nod.reversal_time_ns(leg) == pytest.approx(begin_ns, abs=1000)
        assert leg % 2 == (len(self._commanded) + 1) % 2
        self._commanded.append(nod.reversal_time_ns(leg + 1))
        late = self._noise.normal(0.0, self._error) if self._error else 0.0
        self._turned.append(self._commanded[-1] + round(late * NS_PER_S))


def first_round(chosen, error):
    servo = Servo(ChosenSweeps(TASK, PLANNED, 0.003, 1), error, chosen)
    for number in range(600):
        servo.scan(number)
        if math.isfinite(servo.sweeps.round_time):
            return servo.sweeps.round_time
    raise AssertionError('some cell was never seen')


def test_each_sweep_begins_where_and_when_the_one_before_ends():
    servo = Servo(ChosenSweeps(TASK, PLANNED, 0.003, 1))
    for number in range(60):
        servo.scan(number)  # which checks it
    assert len(servo.nods) > 20
    for _, nod in servo.nods[1:]:
        assert abs(nod.samples_per_sweep / 2501 - 1.0) <= SPREAD + 1e-3
        assert nod.sweep_duration / T_S == pytest.approx(nod.samples_per_sweep, abs=0.51)


def test_no_sweep_is_faster_than_allowed():
    servo = Servo(ChosenSweeps(TASK, PLANNED, 0.003, fewest_samples=2400))
    for number in range(60):
        servo.scan(number)
    assert min(nod.samples_per_sweep for _, nod in servo.nods) >= 2400


def test_it_sees_all_cells_much_sooner_than_the_planned_nod():
    assert first_round(chosen=True, error=0.003) < 0.75 * first_round(chosen=False, error=0.003)


def test_when_all_cells_were_seen_the_next_round_begins():
    servo = Servo(ChosenSweeps(TASK, PLANNED, 0.003, 1), 0.003)
    times = {0: math.nan}
    for number in range(300):
        servo.scan(number)
        times[servo.sweeps.rounds] = servo.sweeps.round_time
    assert sorted(times) == [0, 1, 2, 3, 4]
    assert sum(list(times.values())[1:]) < 30.0
    assert all(taken > lower_bound(TASK, 2125) for taken in list(times.values())[1:])


def test_a_choice_that_would_come_too_late_is_not_made():
    """A turn comes 0.25 s after the one before; here scans are handed over as late as that."""
    servo = Servo(ChosenSweeps(TASK, PLANNED, 0.003, 1))
    now_ns = BEGIN_NS + round(0.22 * NS_PER_S)
    lidar = Revolutions()
    lidar.add(BEGIN_NS, 0.1)
    assert not servo.sweeps.choose(now_ns, lidar, URG)
    assert servo.sweeps.choose(now_ns - 50_000_000, lidar, URG)


def test_a_lidar_that_turns_the_other_way_is_refused():
    lidar = Revolutions()
    lidar.add(BEGIN_NS, 0.1)
    reversed_urg = ScanGeometry(682, 340 * STEP, -STEP, 0.1 / 1024, 0.02, 5.6)
    with pytest.raises(ParameterError, match='angle_increment'):
        ChosenSweeps(TASK, PLANNED, 0.003, 1).choose(BEGIN_NS, lidar, reversed_urg)


def test_sweeps_are_chosen_as_well_when_the_pitch_is_told_late():
    """Sweeps have been chosen since those beams: a turn comes each 0.25 s."""
    servo = Servo(ChosenSweeps(TASK, PLANNED, 0.003, 1), 0.001, notice=0.35)
    for number in range(300):
        servo.scan(number)
    assert servo.sweeps.rounds >= 3
