"""Which nods are on the front, and the figures that they are compared by, by enumeration."""

from dataclasses import replace
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from bench.nod import pareto
from bench.shared.reference import START_NS
from figures import pareto as pareto_figure


def time_of(scan, beam):
    """Return when a beam that is counted from the first measured one is sent [ns]."""
    return START_NS + round((scan * 1024 + 44 + beam) * 1e9 / 10240)


@settings(max_examples=20)
@given(st.integers(1, 4), st.integers(0, 99), st.sampled_from([0.3, 0.7, 2.0]))
def test_first_hits_are_those_of_going_through_all_beams(scans, seed, azimuth):
    task = replace(pareto.REGION, object_size=0.5, azimuth=azimuth)
    pitch = np.random.default_rng(seed).uniform(-0.7, 0.7, (scans, 682))
    times_ns = np.array([[time_of(s, b) for b in range(682)] for s in range(scans)])
    expected = np.full((task.columns, task.rows), np.inf)
    for s in range(scans):
        for b in range(682):
            theta, up = (b - 340) * math.tau / 1024, pitch[s, b] - task.pitch_min
            if abs(theta) <= azimuth and 0.0 <= up <= task.span:
                column = min(int((theta + azimuth) / task.cell), task.columns - 1)
                row = min(int(up / task.cell), task.rows - 1)
                seconds = (time_of(s, b) - START_NS) / 1e9
                expected[column, row] = min(expected[column, row], seconds)
    np.testing.assert_array_equal(pareto.first_hits(times_ns, pitch, task), expected)


def test_fine_squares_hold_one_step_each():
    columns = pareto.FINE.column_of_step()
    np.testing.assert_array_equal(columns[columns >= 0], np.arange(681))
    assert pareto.FINE.cell == pytest.approx(math.tau / 1024)


def test_density_is_that_of_a_grid_of_points():
    side = np.arange(-0.5, 0.5, 0.01)
    grid = np.stack([*map(np.ravel, np.meshgrid(side, side)), np.full(10_000, 2.0)], axis=1)
    on_it, beside = [0.0, 0.0, 2.0], [0.0, 0.0, 2.11]
    density = pareto.local_density(grid, np.array([on_it, beside]))
    assert density[0] == pytest.approx(10_000.0, rel=0.03)
    assert density[1] == 0.0


VALUES = st.none() | st.sampled_from([0.0, 1.0, 2.0, 3.0])


@given(st.lists(st.tuples(VALUES, VALUES), max_size=8))
def test_the_front_is_what_nothing_beats(pairs):
    rows = [{'a': a, 'b': b} for a, b in pairs]
    known = [pair for pair in pairs if None not in pair]
    expected = [
        pair in known and not any(k[0] <= pair[0] and k[1] <= pair[1] and k != pair for k in known)
        for pair in pairs
    ]
    assert pareto.on_front(rows, 'a', 'b') == expected


def test_a_nod_is_near_the_speed_that_was_asked_for_and_coprime():
    for about in pareto.ABOUT[::4]:
        n_s = pareto.chosen(about)
        assert abs(n_s - about) <= pareto.WITHIN * about
        assert math.gcd(n_s, 1024) == 1


def test_a_slower_nod_is_more_exact_and_both_are_in_the_picture(monkeypatch):
    monkeypatch.setattr(pareto, 'SCENES', ('corner',))
    monkeypatch.setattr(pareto_figure, 'COLOURS', {'corner': 'black'})
    monkeypatch.setattr(pareto, 'ABOUT', (1001, 2801, 11201))
    monkeypatch.setattr(pareto, 'RUNS', 1)
    monkeypatch.setattr(pareto, 'DURATION', 10.0)
    unable, fast, slow = rows = pareto.results()
    assert unable[pareto.SERVO] == pareto.CANNOT_REVERSE
    assert pareto.RMS not in unable
    assert fast[pareto.SERVO] == slow[pareto.SERVO] == pareto.HELD
    assert slow[pareto.IDEAL] < fast[pareto.IDEAL] < fast[pareto.RMS]
    assert slow[pareto.RMS] < fast[pareto.RMS]
    assert fast[pareto.EARLY_HOLE] < slow[pareto.EARLY_HOLE]
    early, late = pareto_figure.figure(rows).axes
    assert [text.get_text().strip() for text in early.texts] == [
        str(row[pareto.N_S]) for row in (fast, slow)
    ]
    assert len(late.lines[0].get_xdata()) == 2  # both are on this front
