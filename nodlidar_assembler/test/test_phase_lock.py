"""The nod that is tied to the lidar, against the model's pattern and simulated clocks."""

from dataclasses import replace
import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.phase_lock import PhaseLock, revolutions_to
from nodlidar_common.errors import ParameterError
import numpy as np
import pytest

STEP = 2 * math.pi / 1024
URG = ScanGeometry(682, (44 - 384) * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
STAMP_NS = 1_700_000_000_000_000_000
SHAPE = NodShape(-0.6136, 0.6136, 4001)


def first_nod(geometry=URG, shape=SHAPE):
    lock = PhaseLock(shape, 1024)
    lock.add_scan(geometry, STAMP_NS)
    return lock.nod


def phase(nod, time_ns):
    """Return the samples since the nod was at its lower limit, going up, modulo 2 N_s."""
    return float(nod.sweeps(time_ns)) * nod.samples_per_sweep % (2 * nod.samples_per_sweep)


def apart(a, b, period):
    return abs((a - b + period / 2) % period - period / 2)


def test_the_reference_sensor_nods_at_pi_rad_per_second():
    nod = first_nod(shape=replace(SHAPE, samples_per_sweep=4000))
    assert nod.sweep_duration == pytest.approx(0.390625)
    assert nod.speed == pytest.approx(math.pi, rel=1e-4)


def test_beams_follow_the_model_s_pattern_with_half_a_sample_of_phase():
    n_s, span = 4001, 1.2272
    nod = first_nod()
    n = np.arange(20 * 1024)
    times_ns = STAMP_NS + np.rint(n * 0.1 / 1024 * 1e9).astype(np.int64)
    tri = n_s - np.abs((n + 0.5) % (2 * n_s) - n_s)
    np.testing.assert_allclose(nod.pitch(times_ns), -span / 2 + span / n_s * tri, atol=1e-8)


@settings(max_examples=10)
@given(
    rate=st.floats(-5e-4, 5e-4), n_s=st.integers(1001, 8000), missing=st.floats(0.0, 0.5),
    seed=st.integers(0, 1000),
)  # fmt: skip
def test_sample_n_has_the_phase_n_and_a_half_for_as_long_as_it_runs(rate, n_s, missing, seed):
    rng = np.random.default_rng(seed)
    lock = PhaseLock(replace(SHAPE, samples_per_sweep=n_s), 1024)
    beam_ns = 1e8 / 1024 / (1.0 + rate)
    for turn in range(1200):
        if turn and rng.random() < missing:
            continue
        true_ns = STAMP_NS + round(turn * 1024 * beam_ns)
        lock.add_scan(URG, true_ns + int(rng.uniform(-5e5, 5e5)))
        off = apart(phase(lock.nod, true_ns), turn * 1024 + 0.5, 2 * n_s)
        assert off <= (6e5 if turn < 300 else 2e5) / beam_ns
    assert lock.nod.sweep_duration == pytest.approx(n_s * beam_ns * 1e-9, rel=1e-5)
    assert 0.0 <= true_ns - lock.nod.reference_time_ns <= 2 * n_s * beam_ns + 1e8


@pytest.mark.parametrize(('n_s', 'most'), [(4001, 1.0), (4000, 16.0), (2745, 1.0)])
def test_a_restarted_lidar_lets_the_nod_go_on_at_the_nearest_sample(n_s, most):
    lock = PhaseLock(replace(SHAPE, samples_per_sweep=n_s), 1024)
    for turn in range(50):
        lock.add_scan(URG, STAMP_NS + turn * 100_000_000)
    before = lock.nod
    for turn in range(60, 70):
        lock.add_scan(URG, STAMP_NS + turn * 100_000_000 + 43_210_987)
    now_ns = STAMP_NS + 7_000_000_000
    assert lock.revolutions.restarts == 1
    assert 0.0 < apart(phase(lock.nod, now_ns), phase(before, now_ns), 2 * n_s) <= most + 0.1
    assert phase(lock.nod, lock.revolutions.begin_ns) % 1.0 == pytest.approx(0.5, abs=0.01)


@settings(max_examples=100)
@given(
    turns=st.integers(1, 60), since=st.floats(0.0, 0.3), low=st.floats(-0.8, 0.3),
    span=st.floats(0.2, 1.1), n_s=st.integers(1001, 8000),
)  # fmt: skip
def test_another_shape_goes_on_from_here_or_comes_back_from_outside(turns, since, low, span, n_s):
    lock = PhaseLock(SHAPE, 1024)
    for turn in range(turns):
        lock.add_scan(URG, STAMP_NS + turn * 100_000_000)
    now_ns = lock.revolutions.begin_ns + round(since * 1e9)
    there = float(lock.nod.pitch(now_ns))
    direction = np.sign(lock.nod.velocity(now_ns))
    high = low + span
    lock.change(NodShape(low, high, n_s), now_ns)
    after = lock.nod
    samples = math.gcd(1024, 2 * n_s) / 2 + 1.0
    inaccuracy = samples * span / n_s
    outside = min(max(there - high, low - there), span)
    if outside > inaccuracy:
        back_ns = now_ns + round(outside / after.speed * 1e9)
        limit = high if there > high else low
        assert abs(float(after.pitch(back_ns)) - limit) <= inaccuracy
        if outside < span - inaccuracy:
            assert np.sign(after.velocity(now_ns)) == np.sign(there - limit)
    elif outside < -inaccuracy:
        assert abs(float(after.pitch(now_ns)) - there) <= inaccuracy
        assert np.sign(after.velocity(now_ns)) == direction
    assert phase(after, lock.revolutions.begin_ns) % 1.0 == pytest.approx(0.5, abs=0.01)


@given(st.integers(1, 300), st.integers(1, 300), st.integers(0, 10_000))
def test_the_revolution_to_a_place_is_the_nearest_there_is(n_s, n_l, place):
    found = revolutions_to(place, n_s, n_l) * n_l
    begins = {revolution * n_l % (2 * n_s) for revolution in range(2 * n_s)}
    nearest = min(apart(place, begin, 2 * n_s) for begin in begins)
    assert apart(place, found, 2 * n_s) == nearest


@pytest.mark.parametrize(
    ('key', 'shape'), [('pitch_max', (0.5, 0.5, 4001)), ('samples_per_sweep', (-0.5, 0.5, 0))]
)
def test_what_makes_no_nod_is_refused(key, shape):
    with pytest.raises(ParameterError, match=key):
        NodShape(*shape)


def test_a_lidar_that_is_mounted_upside_down_nods_the_same():
    overhead = replace(URG, angle_min=-URG.angle_min, angle_increment=-STEP)
    assert first_nod(overhead) == first_nod()


def test_a_scan_that_does_not_tell_its_beam_period_makes_no_nod():
    with pytest.raises(ParameterError, match='time_increment'):
        first_nod(replace(URG, time_increment=0.0))


@pytest.mark.parametrize('time_increment', [1e-6, 1e-5, 1e-3])
def test_ten_scans_of_an_absurd_rate_leave_the_nod_as_it_is_when_good_ones_come(time_increment):
    lock, absurd = PhaseLock(SHAPE, 1024), replace(URG, time_increment=time_increment)
    for turn in range(60):
        geometry = absurd if 20 <= turn < 30 else URG
        lock.add_scan(geometry, STAMP_NS + turn * 100_000_000)
    assert lock.nod.sweep_duration == pytest.approx(4001 * 0.1 / 1024, rel=1e-6)


@pytest.mark.parametrize('step_ns', [-3600 * 10**9, 50_000_000, 10**9])
def test_a_nod_is_shifted_with_the_clock(step_ns):
    lock = PhaseLock(SHAPE, 1024)
    for turn in range(40):
        if turn == 20:
            lock.shift(step_ns)
        lock.add_scan(URG, STAMP_NS + turn * 100_000_000 + (turn >= 20) * step_ns)
    assert lock.revolutions.restarts == 0
    at_ns = STAMP_NS + 3_900_000_000 + step_ns
    assert apart(phase(lock.nod, at_ns), 39 * 1024 + 0.5, 8002) < 0.1


def test_the_nod_that_is_commanded_fills_every_cell_of_the_finest_grid_once():
    n_l, n_s = 64, 21
    geometry = ScanGeometry(n_l, -math.pi, 2 * math.pi / n_l, 0.1 / n_l, 0.02, 5.6)
    lock = PhaseLock(NodShape(-0.5, 0.5, n_s), n_l)
    lock.add_scan(geometry, 0)
    nod = lock.nod
    n = np.arange(n_l * n_s)
    pitch = nod.pitch(np.rint(n * 0.1 / n_l * 1e9).astype(np.int64))
    rows = np.floor((pitch + 0.5) * n_s).astype(int)
    count = np.zeros((n_l, n_s), dtype=int)
    np.add.at(count, (n % n_l, rows), 1)
    assert np.array_equal(count, np.ones((n_l, n_s)))
