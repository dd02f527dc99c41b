"""Nods at their limits: an hour of phase, the fewest and the most samples, no span left."""

from fractions import Fraction
import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.phase_lock import PhaseLock
from nodlidar_planner.pattern.pattern import Pattern
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000_000_000_000
HOUR = 36_000  # revolutions
REVOLUTION_NS = Fraction(S, 10) + Fraction(1, 3)  # no whole number of nanoseconds


def lidar(steps):
    """Return a scan of two beams of a lidar with so many steps in a revolution."""
    return ScanGeometry(2, 0.0, 2 * math.pi / steps, 0.1 / steps, 0.02, 5.6)


def begins_ns(revolution):
    return START_NS + round(revolution * REVOLUTION_NS)


def off(nod, time_ns, sample):
    """Return how far the nod is from where a sample shall be: samples, exact in fractions."""
    sweep_ns = Fraction(nod.sweep_duration) * S
    place = Fraction(time_ns - nod.reference_time_ns) / sweep_ns * nod.samples_per_sweep
    cycle = 2 * nod.samples_per_sweep
    return abs(float((place - sample + nod.samples_per_sweep) % cycle - nod.samples_per_sweep))


@pytest.mark.parametrize('n_s', [1, 4001, 10_000_000])
@pytest.mark.parametrize('n_l', [1, 1024, 65_536])
def test_after_an_hour_a_sample_has_the_phase_that_it_had(n_s, n_l):
    """Every tenth scan arrives; the phase is n + 1/2, in samples, for as long as it runs."""
    lock = PhaseLock(NodShape(-0.6, 0.6, n_s), n_l)
    for revolution in range(0, HOUR + 1, 10):
        lock.add_scan(lidar(n_l), begins_ns(revolution))
        if revolution in (0, HOUR // 2, HOUR):
            sample = Fraction(revolution * n_l) + Fraction(1, 2)
            rounding = 2.0 * n_l / float(REVOLUTION_NS)  # of stamps, 2 ns in samples
            assert off(lock.nod, begins_ns(revolution), sample) < rounding
    assert lock.nod.sweep_duration == pytest.approx(n_s * float(REVOLUTION_NS) / n_l / S, rel=1e-9)


def test_an_hour_of_samples_is_counted_without_rounding():
    pattern = Pattern(1024, 4001, 0.5)
    n = 1024 * np.arange(HOUR, HOUR + 10)
    tri = [4001 - abs((Fraction(int(k)) + Fraction(1, 2)) % 8002 - 4001) for k in n]
    assert pattern.height(n).tolist() == [float(h) for h in tri]
    assert pattern.step(n + 7).tolist() == [7] * 10


@pytest.mark.parametrize('span', [5e-324, 1e-300, 1e-12, 1e-6])
def test_a_nod_of_hardly_any_span_stays_within_it(span):
    lock = PhaseLock(NodShape(0.0, span, 4001), 1024)
    for revolution in range(3):
        lock.add_scan(lidar(1024), begins_ns(revolution))
    pitch = lock.nod.pitch(START_NS + np.arange(0, S, 1_234_567))
    assert np.all((pitch >= 0.0) & (pitch <= span))
    assert np.min(pitch) <= 0.1 * span
    assert np.max(pitch) >= 0.9 * span
    assert lock.nod.speed == pytest.approx(span / lock.nod.sweep_duration)


@pytest.mark.parametrize('span', [5e-324, 1e-300, 1e-6])
@pytest.mark.parametrize('middle', [-0.6, 0.0, 0.6])
def test_from_and_to_hardly_any_span_the_nod_goes_on(span, middle):
    wide = NodShape(-0.6, 0.6, 4001)
    narrow = NodShape(middle, max(middle + span, np.nextafter(middle, 1.0)), 1001)
    for first, second in (wide, narrow), (narrow, wide):
        lock = PhaseLock(first, 1024)
        for revolution in range(20):
            lock.add_scan(lidar(1024), begins_ns(revolution))
        lock.change(second, begins_ns(20))
        pitch = lock.nod.pitch(begins_ns(20) + np.arange(0, S, 1_234_567))
        assert np.all((pitch >= second.pitch_min) & (pitch <= second.pitch_max + 1e-15))
        whole = off(lock.nod, lock.revolutions.begin_ns, Fraction(1, 2))
        assert whole == pytest.approx(round(whole), abs=0.01)
