"""Clouds of one beam and of an hour, and the times of their points (docs/extremes.md)."""

from fractions import Fraction
import math
import pickle

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import LONGEST_SWEEP, Pipeline, PipelineConfig, Scan
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_common.nod import Nod
import numpy as np
import pytest

S = 1_000_000_000
TODAY_NS = 1_700_000_000 * S + 999_999_999
STEP = 2 * math.pi / 1024
BEAM_NS = Fraction(S, 10 * 1024)


def geometry(beams, steps_apart=1):
    """Return a scan around straight ahead, of every so many steps of the reference lidar."""
    first = -(beams // 2) * steps_apart * STEP
    return ScanGeometry(beams, first, steps_apart * STEP, steps_apart * 0.1 / 1024, 0.02, 5.6)


def assembled(scans, pitch_at, mode='sweep', sample_ns=20_000_000):
    """Return the clouds of scans of one range each 2 m, with joint samples all along."""
    pipeline = Pipeline(PipelineConfig(cloud_mode=mode))
    clouds, given_ns = [], None
    for start_ns, shape in scans:
        duration_ns = int(pipeline.beams(shape).offset_ns[-1])
        stamps = np.arange(
            start_ns - 2 * sample_ns, start_ns + duration_ns + 3 * sample_ns, sample_ns
        )
        stamps -= stamps[0] % sample_ns
        pitch = pitch_at(stamps)
        for stamp_ns, value in zip(stamps, pitch, strict=True):
            if given_ns is None or stamp_ns > given_ns:
                given_ns = stamp_ns
                pipeline.add_sample(int(stamp_ns), float(value))
        ranges = np.full(shape.beams, 2.0, np.float32)
        clouds += pipeline.add_scan(Scan(int(start_ns), shape, ranges), stamps, pitch).clouds
    return clouds


def at_rest(stamps):
    return np.zeros(len(stamps))


@pytest.mark.parametrize('start_ns', [0, TODAY_NS, 2**31 * S - 16 * S])
def test_times_in_clouds_of_the_longest_sweep_are_below_a_microsecond_off(start_ns):
    scans = [(start_ns + k * S // 10, geometry(682)) for k in range(310)]
    cloud = assembled(scans, at_rest)[0]
    duration = (cloud.time_ns[-1] - cloud.time_ns[0]) / S
    assert LONGEST_SWEEP - 0.1 < duration <= LONGEST_SWEEP
    within = np.array([float(k * BEAM_NS) for k in range(682)])
    exact_ns = (np.arange(len(cloud.data) // 682)[:, None] * (S // 10) + within).ravel()
    np.testing.assert_allclose(cloud.time_ns - start_ns, exact_ns, rtol=0, atol=0.51)
    times = cloud.data['time'].astype(float)
    assert np.max(np.abs(times - exact_ns / S)) < 0.96e-6
    assert np.all(np.diff(times) > 0.0)


@pytest.mark.parametrize('start_ns', [0, TODAY_NS, 2**31 * S - S])
def test_times_in_clouds_of_a_scan_are_nanoseconds_off(start_ns):
    (cloud,) = assembled([(start_ns, geometry(682))], at_rest, mode='scan')
    exact = [float(k * BEAM_NS / S) for k in range(682)]
    np.testing.assert_allclose(cloud.data['time'], exact, rtol=0, atol=4e-9)


def test_scans_of_one_beam_make_clouds_of_one_point():
    scans = [(TODAY_NS + k * S // 10, geometry(1)) for k in range(5)]
    clouds = assembled(scans, lambda stamps: 0.1 + 0.0 * stamps, mode='scan')
    assert [len(cloud.data) for cloud in clouds] == [1] * 5
    for cloud, (start_ns, _) in zip(clouds, scans, strict=True):
        assert cloud.time_ns[0] == start_ns
        assert cloud.data['time'][0] == 0.0
        assert cloud.data['x'][0] == pytest.approx(2 * math.cos(0.1) - 0.08 * math.sin(0.1))


def test_a_sweep_of_one_beam_is_a_cloud_of_one_point():
    """One beam every 0.3 s, on a nod that reverses at 0.15 s and every 0.3 s from then on."""
    nod = Nod(-0.5, 0.5, 0.3, 1, TODAY_NS - 150_000_000)
    scans = [(TODAY_NS + k * 300_000_000, geometry(1)) for k in range(20)]
    pipeline = Pipeline(PipelineConfig(cloud_mode='sweep'))
    stamps = np.arange(TODAY_NS - 200_000_000, TODAY_NS + 7 * S, 10_000_000)
    pitch = nod.pitch(stamps)
    for stamp_ns, value in zip(stamps, pitch, strict=True):
        pipeline.add_sample(int(stamp_ns), float(value))
    clouds = []
    for start_ns, shape in scans:
        clouds += pipeline.add_scan(
            Scan(start_ns, shape, np.ones(1, np.float32)), stamps, pitch
        ).clouds
    assert [len(cloud.data) for cloud in clouds] == [1] * 19  # the last waits for its reversal
    assert [int(cloud.time_ns[0]) for cloud in clouds] == [start_ns for start_ns, _ in scans[:-1]]


def test_a_sweep_of_an_hour_comes_in_clouds_of_half_a_minute_and_loses_nothing():
    nod = Nod(-0.6, 0.6, 3600.0, 36_864_000, TODAY_NS)
    scans = [(TODAY_NS + k * S // 2, geometry(11, steps_apart=30)) for k in range(7200)]
    clouds = assembled(scans, nod.pitch, sample_ns=50_000_000)
    durations = np.array([cloud.time_ns[-1] - cloud.time_ns[0] for cloud in clouds]) / S
    assert np.all(durations <= LONGEST_SWEEP)
    assert np.all(durations > LONGEST_SWEEP - 0.6)
    seen = np.concatenate([cloud.time_ns for cloud in clouds])
    offset_ns = np.array([float(30 * k * BEAM_NS) for k in range(11)])
    since_ns = np.concatenate([start_ns - TODAY_NS + offset_ns for start_ns, _ in scans])
    np.testing.assert_allclose(seen - TODAY_NS, since_ns[: len(seen)], rtol=0, atol=0.51)
    assert len(since_ns) - len(seen) <= 11 * 2 * LONGEST_SWEEP  # the cloud that is still open
    middle = np.concatenate([cloud.data['z'] for cloud in clouds])[5::11]
    phi = [-0.6 + 1.2 * float(t - TODAY_NS) / (3600.0 * S) for t in seen[5::11]]
    np.testing.assert_allclose(middle, 2 * np.sin(phi) + 0.08 * np.cos(phi), rtol=0, atol=3e-7)


def test_a_pause_of_an_hour_ends_the_cloud():
    starts_ns = [TODAY_NS, TODAY_NS + S // 10, TODAY_NS + 3600 * S, TODAY_NS + 3631 * S]
    clouds = assembled([(start_ns, geometry(682)) for start_ns in starts_ns], at_rest)
    assert [len(cloud.data) for cloud in clouds] == [2 * 682, 682]
    assert [int(cloud.time_ns[0]) for cloud in clouds] == [TODAY_NS, TODAY_NS + 3600 * S]
    assert max(float(cloud.data['time'][-1]) for cloud in clouds) < 0.2


def test_no_cloud_joins_points_of_before_and_after_a_pause():
    """The nod rests while scans are missing for 3 s, and goes on; two lost scans are no pause."""
    pause_ns, begin_ns = 3 * S, TODAY_NS + 14 * S // 10
    nod = Nod(-0.5, 0.5, 1.0, 10_240, TODAY_NS)
    scans = [(TODAY_NS + k * S // 10, geometry(11)) for k in (*range(6), *range(8, 14))]
    scans += [(start_ns + pause_ns + 14 * S // 10, shape) for start_ns, shape in scans]
    clouds = assembled(scans, lambda ns: nod.pitch(ns - np.clip(ns - begin_ns, 0, pause_ns)))
    begins = [round((cloud.time_ns[0] - TODAY_NS) / S, 1) for cloud in clouds]
    assert begins == [0.0, 1.0, 4.4]  # the last one is still open
    assert all(cloud.time_ns[-1] - cloud.time_ns[0] <= S for cloud in clouds)


def test_a_joint_at_rest_for_an_hour_is_not_remembered_and_its_next_reversal_is_found():
    """It wavers by one encoder step, then nods at 1 rad/s and reverses after 0.4 s."""
    finder = ReversalFinder()
    rest_ns, sample_ns = 3600 * S, 10_000_000
    for k in range(rest_ns // sample_ns):
        assert finder.add(TODAY_NS + k * sample_ns, 0.00511 * (k % 2)) is None
    assert len(pickle.dumps(finder)) < 1_000_000
    found = []
    for k in range(80):
        since = k * sample_ns / S
        found.append(finder.add(TODAY_NS + rest_ns + k * sample_ns, 0.4 - abs(since - 0.4)))
    (reversal_ns,) = [reversal for reversal in found if reversal is not None]
    assert abs(reversal_ns - (TODAY_NS + rest_ns + 400_000_000)) < 1_000_000
