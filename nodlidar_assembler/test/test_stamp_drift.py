"""Stamps that drift are noticed; messages that are late are not."""

from nodlidar_assembler.plausibility.stamp_drift import MOST_NS, SCANS, StampDrift, WINDOW_NS
from nodlidar_common.stamps import NS_PER_S
import numpy as np
import pytest

MS = 1_000_000


def moved_in(duration, scans=lambda t: 0.0, joints=lambda t: 0.0, seed=1, pause=(0.0, 0.0)):
    """Return what is said about 'joint' at the end of each second.

    Scans at 10 Hz and joint states at 100 Hz come late by up to 30 ms, 4 and 1 ms at least. Their
    stamps are too late by what the functions of the time [s] say [s]. No joint state comes in a
    pause [s].
    """
    drift, rng, said = StampDrift(), np.random.default_rng(seed), []
    for tick in range(round(duration * 100)):
        t = tick / 100
        now_ns = tick * 10 * MS + 5 * NS_PER_S
        if tick % 10 == 0:
            late = 4e-3 + 30e-3 * rng.random() ** 2 - scans(t)
            drift.add(SCANS, round(late * NS_PER_S), now_ns)
        if not pause[0] < t < pause[1]:
            late = 1e-3 + 30e-3 * rng.random() ** 2 - joints(t)
            drift.add('joint', round(late * NS_PER_S), now_ns)
        if tick % 100 == 99:
            said.append(drift.moved.get('joint', 0.0))
    return said


@pytest.mark.parametrize('rate', [2e-4, -2e-4, 1e-3])
def test_a_drift_is_noticed_before_it_has_grown_by_two_windows(rate):
    said = moved_in(100.0, scans=lambda t: rate * t)
    first = next(t for t, moved in enumerate(said, start=1) if moved)
    assert first <= (MOST_NS / NS_PER_S + 2e-3) / abs(rate) + 3 * WINDOW_NS / NS_PER_S + 1
    assert said[-1] == pytest.approx(rate * 85.0, abs=abs(rate) * 11.0 + 1e-3)
    assert moved_in(100.0, joints=lambda t: rate * t)[-1] == pytest.approx(-said[-1], abs=2e-3)


def test_a_drift_that_ends_where_it_began_is_no_longer_told():
    said = moved_in(100.0, scans=lambda t: 0.02 if 30.0 < t < 60.0 else 0.0)
    assert max(said) == pytest.approx(0.02, abs=2e-3)
    assert said[-1] == 0.0


@pytest.mark.parametrize('seed', range(10))
def test_messages_that_are_late_at_random_do_not_drift(seed):
    assert not any(moved_in(100.0, seed=seed))


@pytest.mark.parametrize('ahead', [0.05, 0.4, 5.0])
def test_single_stamps_ahead_of_time_do_not_drift(ahead):
    """From the 40th second on, one scan in 25, or two joint states in 100."""
    assert not any(moved_in(100.0, scans=lambda t: ahead * (t > 40.0 and t % 2.5 < 0.05)))
    assert not any(moved_in(100.0, joints=lambda t: ahead * (t > 40.0 and t % 1.0 < 0.015)))


def test_stamps_of_another_machine_whose_clock_runs_differently_do_not_drift_apart():
    slow = {'scans': lambda t: 2e-4 * t, 'joints': lambda t: 2e-4 * t}
    assert not any(moved_in(100.0, **slow))


@pytest.mark.parametrize('speed', [0.5, 2.0])
def test_a_recording_that_is_played_at_another_speed_does_not_drift(speed):
    played = {'scans': lambda t: (speed - 1.0) * t, 'joints': lambda t: (speed - 1.0) * t}
    assert not any(moved_in(100.0, **played))


def test_an_input_that_was_silent_begins_anew():
    def stamped(t):
        return 0.02 if t > 45.0 else 0.0

    assert any(moved_in(100.0, joints=stamped))
    assert not any(moved_in(100.0, joints=stamped, pause=(30.0, 51.0)))


def test_stamps_that_proved_right_begin_anew():
    drift = StampDrift()
    for tick in range(60):
        later_ns = 20 * MS if tick > 20 else 0
        drift.add(SCANS, 5 * MS - later_ns, tick * NS_PER_S)
        drift.add('joint', 1 * MS, tick * NS_PER_S)
    assert drift.moved == {'joint': pytest.approx(0.02)}
    drift.forget('joint')
    assert not drift.moved
