"""Coverage of a sliding window against counting every beam anew, and closed forms."""

from itertools import product
import math
from time import thread_time

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from nodlidar_assembler.control.observed_coverage import largest_square, ObservedCoverage
from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
SMALL = Task(0.4, 1.0, -0.5, 0.6, steps_per_revolution=64)


def brute_square(free, around):
    columns, rows = free.shape
    best = 0
    for left, bottom in product(range(columns), range(rows)):
        for side in range(1, min(columns, rows) + 1):
            if bottom + side > rows or (left + side > columns and not around):
                break
            taken = np.arange(left, left + side) % columns
            if free[taken, bottom : bottom + side].all():
                best = max(best, side)
    return best


@given(arrays(bool, st.tuples(st.integers(1, 9), st.integers(1, 9))), st.booleans())
def test_the_largest_square_is_that_of_trying_all(free, around):
    assert largest_square(free, around) == brute_square(free, around)


def brute(task, n_s, times_ns, azimuth, pitch, after_ns):
    """Return beams, share seen, hole and repeats of the beams after an instant, one by one."""
    cells, finest, beams = set(), set(), 0
    column_of_step = task.column_of_step()
    for t, a, p in zip(times_ns, azimuth, pitch, strict=True):
        step = round((a + 0.75 * math.pi) / math.tau * task.steps_per_revolution)
        step %= task.steps_per_revolution
        if t > after_ns and column_of_step[step] >= 0 and task.pitch_min <= p <= task.pitch_max:
            beams += 1
            row = min(int((p - task.pitch_min) / task.cell), task.rows - 1)
            cells.add((column_of_step[step], row))
            finest.add((step, min(int((p - task.pitch_min) / task.span * n_s), n_s - 1)))
    free = np.ones((task.columns, task.rows), dtype=bool)
    for cell in cells:
        free[cell] = False
    hole = min(brute_square(free, task.full_circle) * task.cell, task.span)
    return beams, len(cells) / task.cells, hole, (beams - len(finest)) / max(beams, 1)


@settings(max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([SMALL, Task(0.5, 1.0, steps_per_revolution=50, full_circle=True)]),
    st.floats(0.05, 1.0),
    st.integers(1, 40),
)
def test_any_window_is_that_of_counting_anew(seed, task, window, n_s):
    rng = np.random.default_rng(seed)
    coverage = ObservedCoverage(task, n_s, window)
    times_ns = START_NS + np.sort(rng.integers(0, S, 300))
    azimuth, pitch = rng.uniform(-math.pi, math.pi, 300), rng.uniform(-0.7, 0.8, 300)
    for last in range(30, 301, 30):
        scan = slice(last - 30, last)
        coverage.add(times_ns[scan], azimuth[scan], pitch[scan])
        found = coverage.covered()
        after_ns = int(times_ns[last - 1]) - round(window * S)
        expected = brute(task, n_s, times_ns[:last], azimuth[:last], pitch[:last], after_ns)
        assert (found.beams, found.seen, found.hole, found.repeats) == pytest.approx(expected)


def nod_beams(task, pattern, first, count):
    n = np.arange(first, first + count)
    times_ns = START_NS + np.rint(n * task.beam_period * S).astype(np.int64)
    azimuth = task.step_azimuth()[pattern.step(n)]
    return times_ns, azimuth, pattern.pitch(n, task.pitch_min, task.pitch_max)


@pytest.mark.parametrize(('n_s', 'share'), [(401, 0.0), (400, 15 / 16), (408, 7 / 8)])
def test_repeats_of_a_planned_nod_are_those_of_the_common_divisor(n_s, share):
    task = Task(full_circle=True)
    coverage = ObservedCoverage(task, n_s, 0.1 * n_s)
    for revolution in range(n_s):
        coverage.add(*nod_beams(task, Pattern(1024, n_s), 1024 * revolution, 1024))
    found = coverage.covered()
    assert found.beams == 1024 * n_s
    assert found.repeats == pytest.approx(share, abs=1e-12)
    assert found.least_repeats == 0.0


def test_beams_beyond_the_finest_grid_cannot_but_repeat():
    """9 revolutions hit each of 64 x 9 cells once; 36 of them hit it four times."""
    task = Task(0.4, 1.0, -0.5, 0.5, full_circle=True, steps_per_revolution=64)
    coverage = ObservedCoverage(task, 9, 10.0)
    coverage.add(*nod_beams(task, Pattern(64, 9), 0, 4 * 9 * 64))
    found = coverage.covered()
    assert found.repeats == found.least_repeats == 0.75
    assert (found.seen, found.hole) == (1.0, 0.0)


def test_before_the_first_scan_the_whole_region_is_a_hole():
    found = ObservedCoverage(Task(), 4001, 5.0).covered()
    assert (found.beams, found.seen, found.repeats, found.least_repeats) == (0, 0.0, 0.0, 0.0)
    assert found.hole == Task().span


def cost_of_a_scan(window, scans):
    """Return the processor time of the later half of some scans, in the median [s]."""
    coverage, costs = ObservedCoverage(Task(), 4001, window), []
    for scan in scans:
        begin = thread_time()
        coverage.add(*scan)
        coverage.covered()
        costs.append(thread_time() - begin)
    return np.median(costs[len(costs) // 2 :])


def test_a_scan_costs_as_much_however_long_the_window():
    task, pattern = Task(), Pattern(1024, 4001)
    scans = [nod_beams(task, pattern, 1024 * k + 44, 682) for k in range(80)]
    assert cost_of_a_scan(8.0, scans) < 2.0 * cost_of_a_scan(0.5, scans)


def test_what_is_not_possible_is_named():
    with pytest.raises(ParameterError, match="'window'"):
        ObservedCoverage(SMALL, 9, 0.0)
    with pytest.raises(ParameterError, match="'samples_per_sweep'"):
        ObservedCoverage(SMALL, 2**26, 1.0)
    coverage = ObservedCoverage(SMALL, 9, 1.0)
    coverage.add(np.array([START_NS]), np.zeros(1), np.zeros(1))
    for times_ns in ([START_NS - 1], [START_NS + 2, START_NS + 1]):
        with pytest.raises(ParameterError, match="'times_ns'"):
            coverage.add(np.array(times_ns), np.zeros(len(times_ns)), np.zeros(len(times_ns)))
    with pytest.raises(ParameterError, match="'times_ns'"):
        coverage.add(np.array([START_NS]), np.zeros(2), np.zeros(2))
