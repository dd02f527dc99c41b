"""Ranges of level scans, from beams in the plane whose ranges are known in closed form."""

from dataclasses import replace
from functools import partial
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig, ranges_of
from nodlidar_assembler.clouds.level_scan import LevelScanner
from nodlidar_assembler.clouds.pipeline import Pipeline, Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
# Azimuths -0.1, 0 and 0.1 rad.
CONFIG = LevelScanConfig(level_scan_angle=0.1, level_scan_beams=3)


def ranges(beams, config=CONFIG):
    """Return the ranges of beams (azimuth, where they enter the band, where they end, hit)."""
    azimuth, begin, end, hit = np.array(beams, dtype=float).reshape(-1, 4).T
    ways = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    return ranges_of(begin[:, None] * ways, end[:, None] * ways, hit.astype(bool), config)


@pytest.mark.parametrize(
    ('beams', 'expected'),
    [
        ([], np.nan),
        ([(0.0, 0.0, 1.0, True)], 1.0),
        # One surface and another one behind it, by 4 x 8.8 mm and, farther away, by 4 x 20 mm.
        ([(0.01, 0.0, 1.0, True), (-0.01, 0.0, 1.034, True)], 1.017),
        ([(0.0, 0.0, 1.0, True), (0.0, 0.0, 1.036, True)], 1.0),
        ([(0.0, 0.0, 4.5, True), (0.0, 0.0, 4.576, True)], 4.538),
        ([(0.0, 0.0, 4.5, True), (0.0, 0.0, 4.582, True)], 4.5),
        ([(0.0, 0.0, 1.0, True), (0.0, 0.0, 9.0, False)], 1.0),  # free at another height
        ([(0.0, 0.0, 1.9, False)], np.nan),  # left the band
        ([(0.0, 0.0, 2.1, False)], np.inf),
        ([(0.0, 2.1, 4.0, False)], np.nan),  # came into the band behind the circle
        ([(0.0, 0.0, 4.9, True)], 4.9),
        ([(0.0, 0.0, 5.1, True)], np.inf),  # beyond range_max
    ],
)
def test_an_azimuth_is_a_surface_or_free_or_not_seen(beams, expected):
    assert ranges(beams) == pytest.approx([np.nan, expected, np.nan], nan_ok=True)


def test_the_edge_of_a_beam_counts_where_no_middle_does():
    edge = (0.046, 0.0, 1.0, True)  # 4 mrad from the azimuths that are nearest to 0.1
    assert ranges([edge]) == pytest.approx([np.nan, 1.0, 1.0], nan_ok=True)
    free = (0.1, 0.0, 9.0, False)
    assert ranges([edge, free]) == pytest.approx([np.nan, 1.0, np.inf], nan_ok=True)
    sharp = LevelScanConfig(level_scan_angle=0.1, level_scan_beams=3, beam_width=0.0)
    assert ranges([edge], sharp) == pytest.approx([np.nan, 1.0, np.nan], nan_ok=True)


distances = st.floats(0.1, 8.0).map(lambda value: round(value, 3))
some_beams = st.lists(
    st.tuples(st.floats(-0.3, 0.3), distances, distances, st.booleans()), max_size=30
)


@given(some_beams)
def test_no_range_is_nearer_than_the_nearest_hit_or_averages_two_surfaces(beams):
    beams = [(azimuth, *sorted((a, b)), hit) for azimuth, a, b, hit in beams]
    reach = 0.05 + CONFIG.beam_width / 2 + 1e-6
    for azimuth, found in zip((-0.1, 0.0, 0.1), ranges(beams), strict=True):
        near = [beam for beam in beams if abs(beam[0] - azimuth) <= reach]
        hits = [end for _, _, end, hit in near if hit and end <= 5.0]
        passes = [begin <= 2.0 < end for _, begin, end, _ in near]
        if np.isfinite(found):
            assert any(end - 1e-6 <= found <= end + 0.1 for end in hits)
        elif np.isinf(found):
            assert any(passes)
        else:
            surely = [abs(beam[0] - azimuth) < 0.049 for beam in near]
            assert not any(sure and free for sure, free in zip(surely, passes, strict=True))


def test_a_free_azimuth_must_not_end_behind_the_range():
    with pytest.raises(ParameterError, match=r'at most level_scan_range = 1\.5 m'):
        check(LevelScanConfig(level_scan_range=1.5))


def level_scans(beam_period):
    """Return how many level scans 50 scans of a beam period give, one at each scan."""
    config = AssemblerConfig(level_scan='scan', sensor_height=0.5)
    pipeline, scanner = Pipeline(config), LevelScanner(config)
    geometry = ScanGeometry(450, 0.0, math.tau / 450, beam_period, 0.02, 12.0)
    sample_ns = START_NS + np.arange(-100, 700) * 10_000_000
    pitch = 0.5 * np.abs(np.arange(-100, 700) % 140 - 70) / 70
    count = 0
    for stamp_ns in range(START_NS, START_NS + 5_000_000_000, 100_000_000):
        # No two scans of a real lidar are equal.
        ranges = np.full(450, 2.0 + 1e-5 * (stamp_ns // 100_000_000 % 2), np.float32)
        scan = Scan(stamp_ns, geometry, ranges)
        around = np.abs(sample_ns - stamp_ns) < 200_000_000
        count += len(scanner.add(pipeline.add_scan(scan, sample_ns[around], pitch[around])))
    return count


@pytest.mark.parametrize('beams_too_many', [0, 1, 5])
def test_scans_that_overlap_a_little_all_count(beams_too_many):
    """As of drivers that stamp a scan when it has come, with the time since the one before."""
    assert level_scans(0.1 / (449 - beams_too_many)) == level_scans(0.1 / 460) > 10


def steady(seconds):
    """Return the pitch of a nod with a sweep of 0.74 s each way."""
    return np.interp(seconds % 1.48, [0.0, 0.74, 1.48], [-0.5, 0.5, -0.5])


def returning(phase, seconds):
    """Return the pitch of a nod that goes down in 0.2 s, and sees two rows then."""
    return np.interp((seconds + phase) % 0.94, [0.0, 0.74, 0.94], [-0.5, 0.5, -0.5])


def resting(seconds):
    """Return the pitch of a nod that stops after 4.8 s, in the middle of a sweep up."""
    return np.where(seconds < 4.81, steady(seconds), steady(4.81))


def turning_back(pause, seconds):
    """Return the pitch of a nod that stops after 3.33 s on the way up, and goes down again."""
    down = 3.33 + pause + 0.37  # at -0.5 rad
    later = np.interp(seconds, [3.33, 3.33 + pause, down], [steady(3.33), steady(3.33), -0.5])
    begun = np.where(seconds < 3.33, steady(seconds), later)
    return np.where(seconds < down, begun, steady(seconds - down))


def slowing(seconds):
    """Return the pitch of a nod that is three times as slow from 2.96 s on."""
    slower = -0.5 + np.abs((seconds - 2.96) % 4.44 - 2.22) / 2.22
    return np.where(seconds < 2.96, steady(seconds), -slower)


def around_a_box(pitch_at, seen=lambda number: True, blind_after=100, commanded_ns=0):
    """Return the level scans of 10 s amid a box, 1.2 m away, that only rows below -0.2 rad hit.

    One for each sweep, and one for each scan.
    """
    config = AssemblerConfig(mixed_pixel_angle=0.0, level_scan_beams=61)
    pipeline = Pipeline(config)
    scanners = [LevelScanner(replace(config, level_scan=mode)) for mode in ('sweep', 'scan')]
    for scanner in scanners:
        scanner.commanded_ns = commanded_ns
    beams, period_ns = 200, 100_000_000  # several for each azimuth of a level scan
    geometry = ScanGeometry(beams, 0.0, math.tau / beams, 0.1 / beams, 0.02, 12.0)
    sample_ns = START_NS + np.arange(-20, 1020) * 10_000_000
    samples = pitch_at((sample_ns - START_NS) / 1e9)
    found = [], []
    for number in filter(seen, range(100)):
        stamp_ns = START_NS + number * period_ns
        seconds = (number * period_ns + np.arange(beams) * period_ns / beams) / 1e9
        ranges = np.where(pitch_at(seconds) < -0.2, 1.2, 4.0)
        ranges += 1e-5 * (number % 7)  # no two scans of a real lidar are equal
        if number > blind_after:
            ranges[:] = np.nan
        scan = Scan(stamp_ns, geometry, ranges.astype(np.float32))
        around = np.abs(sample_ns - stamp_ns) < 200_000_000
        assembled = pipeline.add_scan(scan, sample_ns[around], samples[around])
        for scans, scanner in zip(found, scanners, strict=True):
            scans += scanner.add(assembled)
    return found


def shows_box(scan):
    """Return whether a level scan has the box at each azimuth."""
    return bool(np.all(scan.ranges < 1.3))


NODS = {
    'steady': steady,
    'resting': resting,
    # Not whole periods of a scan apart, so that reversals are elsewhere in a scan.
    **{f'returning, {k}': partial(returning, 0.105 * k) for k in range(9)},
    **{f'turning back after {pause} s': partial(turning_back, pause) for pause in (0.0, 0.7, 2.0)},
}


@pytest.mark.parametrize('pitch_at', NODS.values(), ids=NODS)
def test_no_level_scan_lacks_the_rows_of_a_part_of_the_nod(pitch_at):
    for found in around_a_box(pitch_at):
        assert len(found) >= 3
        assert all(map(shows_box, found))


def test_a_nod_that_is_commanded_to_be_slower_does_not_rest():
    """Sweeps end at 1.48 s, 2.22 s and 2.96 s, then at 5.18 s, 7.4 s and 9.62 s."""
    commanded = around_a_box(slowing, commanded_ns=2_220_000_000)
    for found in commanded:
        assert all(map(shows_box, found))
        seen_ns = [scan.stamp_ns - START_NS for scan in found]
        assert max(np.diff([*seen_ns, 10_000_000_000])) < 2_300_000_000
    unknown = around_a_box(slowing)
    assert all(len(less) < len(more) for less, more in zip(unknown, commanded, strict=True))


@pytest.mark.parametrize('first', range(40, 48))  # a sweep takes 7.4 scans
@pytest.mark.parametrize('pitch_at', [steady, partial(returning, 0.8)])
def test_a_sweep_that_misses_scans_makes_no_level_scan(first, pitch_at):
    for found in around_a_box(pitch_at, lambda number: not first <= number < first + 4):
        assert len(found) >= 6
        assert all(map(shows_box, found))


def test_a_single_scan_that_is_missing_costs_no_level_scan_of_a_sweep():
    whole, each = map(len, around_a_box(steady))
    found = around_a_box(steady, lambda number: number != 47)
    assert list(map(len, found)) == [whole, each - 1]
    assert all(shows_box(scan) for scans in found for scan in scans)


def test_what_a_covered_lidar_does_not_see_is_not_free():
    for found in around_a_box(steady, blind_after=50):
        assert len(found) >= 5
        assert not any(np.all(np.isposinf(scan.ranges)) for scan in found)
        # Of the sweep in which it was covered, and of no later one.
        assert found[-1].stamp_ns < START_NS + 5_100_000_000 + 2 * 740_000_000
