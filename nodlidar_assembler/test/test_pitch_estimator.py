"""The chosen estimator on simulated data: what it asks for, its errors, and its fallback."""

from collections import Counter
from contextlib import suppress
import math

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.pitch import beam_pitch, PitchError, SplineError
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, PitchEstimator
from nodlidar_assembler.clouds.pitch_smoother import PitchSmoother
from nodlidar_common.nod import Nod
from nodlidar_sim.world.nod_motion import triangle_motion
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
OFFSET = np.arange(682) * 97.65625e-6
STEP = 0.00511
MAX_GAP = 0.1
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, START_NS)
SAMPLE_NS = START_NS + np.rint(np.arange(620) / 62.0 * 1e9).astype(np.int64)
SCANS_NS = START_NS + np.arange(5, 90) * 100_000_000


def errors_of(estimator, jitter):
    """Return the errors of all beams [rad] of scans over ten seconds of the reference nod."""
    motion = triangle_motion(NOD, START_NS, START_NS + 10_000_000_000, jitter=jitter, seed=1)
    samples = np.rint(motion.position(SAMPLE_NS) / STEP) * STEP
    errors = []
    for scan_ns in SCANS_NS:
        beams_ns = scan_ns + np.rint(OFFSET * 1e9).astype(np.int64)
        wanted = (beams_ns[0] - estimator.margin_ns, beams_ns[-1] + estimator.margin_ns)
        first, last = np.searchsorted(SAMPLE_NS, wanted)
        around = slice(first - 1, last + 1)
        pitch = estimator.pitch(int(scan_ns), OFFSET, SAMPLE_NS[around], samples[around])
        errors.append(pitch - motion.position(beams_ns))
    return np.array(errors)


@pytest.mark.parametrize('jitter', [0.0, 0.003, 0.008])
def test_trajectory_has_less_error_than_slerp(jitter):
    trajectory = PitchEstimator(EstimatorConfig(estimator='trajectory'))
    smoothed = np.sqrt(np.mean(errors_of(trajectory, jitter) ** 2))
    slerp = np.sqrt(np.mean(errors_of(PitchEstimator(EstimatorConfig()), jitter) ** 2))
    assert smoothed < 0.8 * slerp
    assert slerp > 1.7e-3
    assert not trajectory.fallbacks


def test_only_trajectory_asks_for_more_than_the_bracket():
    assert (
        PitchEstimator(EstimatorConfig(estimator='trajectory', smoothing_margin=0.15)).margin_ns
        == 150_000_000
    )
    for name in ('nearest', 'ends', 'slerp'):
        assert (
            PitchEstimator(EstimatorConfig(estimator=name, smoothing_margin=0.15)).margin_ns == 0
        )


def test_the_order_in_which_samples_arrive_makes_no_difference():
    sample_ns = START_NS + np.arange(-12, 18) * 16_000_000
    swinging = 0.5 * np.sin((sample_ns - START_NS) / 1e9 * 12.0)
    config = EstimatorConfig(estimator='trajectory')
    np.testing.assert_array_equal(
        PitchEstimator(config).pitch(START_NS, OFFSET, sample_ns, swinging),
        PitchEstimator(config).pitch(START_NS, OFFSET, sample_ns[::-1], swinging[::-1]),
    )


def test_what_is_no_spline_is_slerp_and_counted(monkeypatch):
    def fail(*_args):
        raise SplineError('undetermined')

    monkeypatch.setattr(PitchSmoother, 'pitch', fail)
    estimator = PitchEstimator(EstimatorConfig(estimator='trajectory'))
    samples = START_NS + np.arange(-12, 18) * 16_000_000, np.linspace(-0.1, 0.1, 30)
    expected = beam_pitch('slerp', START_NS, OFFSET, *samples, MAX_GAP)
    np.testing.assert_array_equal(estimator.pitch(START_NS, OFFSET, *samples), expected)
    assert estimator.fallbacks == {'undetermined': 1}


def test_samples_that_do_not_bracket_the_scan_are_refused_and_no_fallback():
    estimator = PitchEstimator(EstimatorConfig(estimator='trajectory'))
    sample_ns = START_NS + np.arange(1, 30) * 16_000_000
    with pytest.raises(PitchError, match='before the first beam'):
        estimator.pitch(START_NS, OFFSET, sample_ns, np.zeros(29))
    assert not estimator.fallbacks


def test_a_log_gives_what_it_has_where_the_margin_goes_beyond_it():
    log = SensorLog([], SAMPLE_NS[:10], np.zeros(10))
    assert log.samples_around(int(SAMPLE_NS[4]), int(SAMPLE_NS[6])) == slice(4, 7)
    assert log.samples_around(int(SAMPLE_NS[4]) - 10**9, int(SAMPLE_NS[6]) + 10**9) == slice(0, 10)


def nod_samples(reversal_s, apart=0.01, missing=(), since=-0.05):
    """Return samples of a reversal at an instant [s], but for some of them [s]."""
    times = np.arange(since, 0.13, apart)
    kept = [not any(abs(t - gone) < apart / 2 for gone in missing) for t in times]
    half, speed, acceleration = 0.015, 3.0, 200.0
    away = np.abs(times - reversal_s)
    pitch = np.where(
        away > half,
        -speed * (away - half) - speed * half / 2,
        -acceleration * away**2 / 2,
    )
    stamps_ns = START_NS + np.rint(times * 1e9).astype(np.int64)
    return stamps_ns[kept], (np.rint(pitch / STEP) * STEP)[kept]


@pytest.mark.parametrize('apart', [0.01, 0.016, 0.02])
@pytest.mark.parametrize('reversal_s', [0.0, 0.021, 0.033, 0.066])
def test_a_reversal_that_samples_show_is_interpolated(apart, reversal_s):
    for name in ('slerp', 'ends'):
        pitch = PitchEstimator(EstimatorConfig(estimator=name)).pitch(
            START_NS, OFFSET, *nod_samples(reversal_s, apart)
        )
        assert len(pitch) == len(OFFSET)


@pytest.mark.parametrize('name', ['slerp', 'ends', 'trajectory'])
def test_a_reversal_in_a_gap_is_refused(name):
    gone = (0.02, 0.03, 0.04)
    with pytest.raises(PitchError, match='joint samples missing at a reversal'):
        PitchEstimator(EstimatorConfig(estimator=name)).pitch(
            START_NS, OFFSET, *nod_samples(0.03, missing=gone)
        )


def test_samples_that_each_came_with_a_scan_show_no_usual_gap():
    """A scan of one instant that a sample has needs no other."""
    estimator, instant = PitchEstimator(EstimatorConfig()), np.zeros(1)
    times_ns, pitch = START_NS + np.array([0, 50_000_000]), np.array([0.1, 0.2])
    for time_ns, one in zip(times_ns, pitch, strict=True):
        sample = np.array([time_ns]), np.array([one])
        np.testing.assert_allclose(estimator.pitch(int(time_ns), instant, *sample), one)
    between = estimator.pitch(START_NS + 25_000_000, instant, times_ns, pitch)
    np.testing.assert_allclose(between, [0.15])


def test_a_gap_on_a_straight_way_is_interpolated():
    stamps_ns, samples = nod_samples(10.0, missing=(0.02, 0.03, 0.04))
    pitch = PitchEstimator(EstimatorConfig()).pitch(START_NS, OFFSET, stamps_ns, samples)
    line = np.polynomial.Polynomial.fit(OFFSET, pitch, 1)
    np.testing.assert_allclose(pitch, line(OFFSET), atol=STEP)


def test_a_reversal_in_a_gap_is_refused_also_where_gaps_are_many():
    estimator = PitchEstimator(EstimatorConfig())
    before_ns, before = nod_samples(0.05, since=-1.53)
    estimator.pitch(int(before_ns[0]), np.zeros(1), before_ns[:149], before[:149])
    with pytest.raises(PitchError, match='joint samples missing at a reversal'):
        estimator.pitch(START_NS, OFFSET, *nod_samples(0.05, apart=0.04))


def test_another_rate_becomes_usual():
    estimator = PitchEstimator(EstimatorConfig())
    for apart in (10_000_000, 40_000_000):
        stamps_ns = START_NS - 10**10 + np.arange(150) * apart
        estimator.pitch(int(stamps_ns[0]), np.zeros(1), stamps_ns, np.zeros(150))
    estimator.pitch(START_NS, OFFSET, *nod_samples(0.05, apart=0.04))
    later = START_NS - 2 * 10**10 + np.arange(150) * 10_000_000  # the clock was set back
    estimator.pitch(int(later[0]), np.zeros(1), later, np.zeros(150))
    with pytest.raises(PitchError, match='joint samples missing at a reversal'):
        estimator.pitch(START_NS, OFFSET, *nod_samples(0.05, apart=0.04))


@pytest.mark.parametrize('share', [0.5, 0.2, 0.1])
def test_reversals_are_not_cut_off_where_most_samples_are_lost(share):
    motion = triangle_motion(NOD, START_NS, START_NS + 60_000_000_000)
    stamps_ns = START_NS + np.arange(6000) * 10_000_000
    stamps_ns = stamps_ns[np.random.default_rng(1).random(6000) < share]
    samples = np.rint(motion.position(stamps_ns) / STEP) * STEP
    estimator, errors = PitchEstimator(EstimatorConfig()), []
    for scan_ns in START_NS + np.arange(5, 590) * 100_000_000:
        beams_ns = scan_ns + np.rint(OFFSET * 1e9).astype(np.int64)
        first, last = np.searchsorted(stamps_ns, (beams_ns[0], beams_ns[-1]))
        around = slice(first - 1, last + 1)
        with suppress(PitchError):
            pitch = estimator.pitch(int(scan_ns), OFFSET, stamps_ns[around], samples[around])
            errors.append(np.abs(pitch - motion.position(beams_ns)).max())
    assert len(errors) > 30
    assert max(errors) < 0.025


def test_a_slow_nod_with_late_coarse_samples_is_not_refused():
    """As with a hobby servo over Wi-Fi: whole degrees at 20 Hz, stamped on arrival, in bursts.

    At 0.2 rad/s a gap of 0.1 s cuts off 10 mrad of a reversal at most.
    """
    rng = np.random.default_rng(1)
    nod = Nod(-0.5, 0.5, 5.0, 51_200, START_NS)
    motion = triangle_motion(nod, START_NS, START_NS + 60_000_000_000)
    taken_ns = START_NS + np.arange(1200) * 50_000_000
    samples = np.radians(np.rint(np.degrees(motion.position(taken_ns))))
    arrived_ns = np.maximum.accumulate(taken_ns + rng.exponential(15e6, 1200).astype(np.int64))
    estimator, refused = PitchEstimator(EstimatorConfig()), Counter()
    for scan_ns in START_NS + np.arange(5, 590) * 100_000_000:
        first, last = np.searchsorted(arrived_ns, (scan_ns, scan_ns + 1))
        around = slice(first - 1, last + 1)
        try:
            estimator.pitch(int(scan_ns), np.zeros(10), arrived_ns[around], samples[around])
        except PitchError as error:
            refused[str(error)] += 1
    assert refused['joint samples missing at a reversal'] == 0


@pytest.mark.parametrize(('jitter_s', 'most'), [(0.001, 3), (0.002, 3), (0.003, 29)])
def test_stamps_that_jitter_are_not_taken_for_lost_samples(jitter_s, most):
    """590 scans of a fast nod; the samples are of 100 Hz, and none is lost."""
    motion = triangle_motion(NOD, START_NS, START_NS + 60_000_000_000)
    taken_ns = START_NS + np.arange(6000) * 10_000_000
    jitter_ns = np.random.default_rng(1).normal(0.0, jitter_s * 1e9, 6000)
    stamps_ns = taken_ns + np.rint(jitter_ns).astype(np.int64)
    order = np.argsort(stamps_ns)
    stamps_ns = stamps_ns[order]
    samples = np.rint(motion.position(taken_ns) / STEP)[order] * STEP
    estimator, refused = PitchEstimator(EstimatorConfig()), 0
    for scan_ns in START_NS + np.arange(5, 590) * 100_000_000:
        first, last = np.searchsorted(stamps_ns, (scan_ns, scan_ns + round(OFFSET[-1] * 1e9)))
        around = slice(first - 1, last + 1)
        try:
            estimator.pitch(int(scan_ns), OFFSET, stamps_ns[around], samples[around])
        except PitchError:
            refused += 1
    assert refused <= most


def test_a_gap_that_ends_at_the_first_beam_is_not_used():
    stamps_ns = START_NS + np.array([-500, 0, 50, 100]) * 1_000_000
    pitch = beam_pitch('slerp', START_NS, OFFSET, stamps_ns, np.arange(4.0), MAX_GAP)
    np.testing.assert_allclose(pitch, 1.0 + OFFSET / 0.05)


@pytest.mark.parametrize('estimator', ['slerp', 'ends', 'trajectory'])
def test_among_samples_that_jump_no_beam_is_placed(estimator):
    """As of a count that wraps; trajectory would be wrong beside the jump as well."""
    sample_ns = START_NS + np.arange(-30, 40) * 10_000_000
    pitch = (sample_ns - START_NS) / 1e9 - 0.3  # at 1 rad/s
    for first in range(1, 70):
        jumping = pitch + math.tau * (np.arange(70) >= first)
        with pytest.raises(PitchError, match='joint jumps: it moves faster than 100 rad/s'):
            PitchEstimator(EstimatorConfig(estimator=estimator)).pitch(
                START_NS, OFFSET, sample_ns, jumping
            )


def test_samples_an_instant_apart_may_differ_by_a_tick_of_the_encoder():
    sample_ns = START_NS + np.sort(np.r_[np.arange(-5, 15) * 10_000_000, 30_010_000])
    pitch = np.where(sample_ns > START_NS + 30_000_000, 0.00614, 0.0)
    PitchEstimator(EstimatorConfig()).pitch(START_NS, OFFSET, sample_ns, pitch)
