"""Pitch limits from the median range: what always holds, and scenes in virtual time."""

import dataclasses
import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.control.pitch_limits import (
    HYSTERESIS,
    LEAST_POINTS,
    limits_at,
    PitchLimits,
    PitchLimitsConfig,
    ranges_that_count,
)
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.parameters import check
from nodlidar_common.pose import Pose
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene, parse_scene
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
SCAN_NS = S // 10
CONFIG = PitchLimitsConfig()
SWEEP = 4001 * 0.1 / 1024

ends = st.floats(-3.0, 3.0)


@st.composite
def configs(draw):
    low, bottom = draw(st.floats(-1.5, 1.0)), draw(ends)
    span = draw(st.floats(0.05, 1.5 - low))
    return PitchLimitsConfig(
        band_bottom=bottom,
        band_top=bottom + draw(st.floats(0.01, 4.0)),
        sensor_height=draw(ends),
        pitch_min=low,
        pitch_max=low + span,
        limits_rate=draw(st.floats(0.05, 10.0)),
    )


def least_span(config):
    return min(0.2, config.pitch_max - config.pitch_min)


@given(configs(), st.floats(0.0, 100.0))
def test_limits_are_within_the_mount_and_the_least_span_apart(config, distance):
    low, high = limits_at(config, distance)
    assert config.pitch_min <= low < high <= config.pitch_max
    assert high - low >= least_span(config) - 1e-12


@given(
    st.sampled_from([0.0, math.pi]),  # upright, or hung from above
    st.floats(-0.5, 0.5),
    st.floats(-0.3, 0.3),
    st.floats(1.0, 4.0),
)
def test_the_limits_of_a_tilted_mount_see_the_whole_band(upright, roll, pitch, distance):
    """The middle beam ends at the ends of the band, at the same distance as without a tilt."""
    tilt = math.remainder(upright + roll, math.tau), pitch
    config = PitchLimitsConfig(pitch_min=-1.5, pitch_max=1.5, mount_tilt=tilt)
    limits = limits_at(config, distance)
    beams = np.array([(math.cos(phi), 0.0, math.sin(phi)) for phi in limits])
    x, y, z = Pose.from_xyzrpy((0.0, 0.0, 0.0, *tilt, 0.0)).rotation @ beams.T
    heights = 1.08 + distance * z / np.hypot(x, y)
    assert sorted(heights.tolist()) == pytest.approx([0.1, 2.0])


@given(st.floats(0.2, 4.0), st.floats(0.0, 4.0))
def test_a_band_is_seen_whole_where_mount_and_least_span_allow(distance, further):
    config = PitchLimitsConfig(pitch_min=-1.5, pitch_max=1.5)
    low, high = limits_at(config, distance)
    assert distance * math.tan(high) == pytest.approx(2.0 - 1.08)
    assert distance * math.tan(low) == pytest.approx(0.1 - 1.08)
    far_low, far_high = limits_at(config, distance + further)
    assert low <= far_low < far_high <= high


@given(st.floats(10.0, 100.0), st.floats(-2.0, 3.0))
def test_a_band_that_needs_less_than_the_least_span_is_in_its_middle(distance, bottom):
    """From 10 m on, the band of 1 m subtends at most half of it."""
    config = PitchLimitsConfig(band_bottom=bottom, band_top=bottom + 1.0)
    ends = (math.atan2(height - 1.08, distance) for height in (bottom, bottom + 1.0))
    low, high = limits_at(config, distance)
    assert (low + high) / 2.0 == pytest.approx(sum(ends) / 2.0)
    assert high - low == pytest.approx(0.2)


@given(configs(), st.floats(0.0, 50.0), st.floats(0.0, 50.0))
def test_around_the_sensor_a_further_wall_never_needs_more_span(config, distance, further):
    middle = (config.band_bottom + config.band_top) / 2.0
    config = dataclasses.replace(config, sensor_height=middle)
    near, far = limits_at(config, distance), limits_at(config, distance + further)
    assert far[1] - far[0] <= near[1] - near[0] + 1e-12


step = st.tuples(
    st.integers(0, 2 * S), st.floats(-0.5, 0.5), st.lists(st.floats(width=32), max_size=3)
)


@given(configs(), st.lists(step, min_size=1, max_size=40))
def test_mount_span_and_rate_are_kept_whatever_happens(config, steps):
    limits, now_ns = PitchLimits(config), START_NS
    before = limits.limits(now_ns)
    for pause_ns, forward, ranges in steps:
        now_ns += pause_ns
        limits.add_motion(forward)
        limits.update(now_ns, np.repeat(ranges, LEAST_POINTS))
        after = limits.limits(now_ns)
        assert config.pitch_min <= after[0] < after[1] <= config.pitch_max
        assert after[1] - after[0] >= least_span(config) - 1e-9
        most = config.limits_rate * pause_ns / S + 1e-12
        assert max(abs(b - a) for a, b in zip(before, after, strict=True)) <= most
        before = after


def fed(medians, limits=None, start_ns=START_NS):
    """Feed one scan of equal ranges every 0.1 s; return the limits after each, shape (n, 2)."""
    limits = PitchLimits(CONFIG) if limits is None else limits
    rows = []
    for k, median in enumerate(medians):
        limits.update(start_ns + k * SCAN_NS, np.full(100, median))
        rows.append(limits.limits(start_ns + k * SCAN_NS))
    return np.array(rows)


def test_until_a_range_is_seen_the_limits_are_the_mounts():
    assert (fed([np.inf] * 30) == [CONFIG.pitch_min, CONFIG.pitch_max]).all()


@pytest.mark.parametrize('nothing', [np.inf, -np.inf, np.nan, 0.0])
def test_when_nothing_is_seen_the_last_limits_stay(nothing):
    rows = fed([2.0] * 30 + [nothing] * 100)
    np.testing.assert_array_equal(rows[30:], np.tile(limits_at(CONFIG, 2.0), (100, 1)))


def test_a_step_is_followed_after_half_a_window_and_complete_within_a_second():
    limits = PitchLimits(CONFIG)
    fed([4.0] * 30, limits)
    rows = fed([1.6] * 30, limits, START_NS + 30 * SCAN_NS)
    old, new = limits_at(CONFIG, 4.0), limits_at(CONFIG, 1.6)
    assert rows[6] == pytest.approx(old)
    assert rows[8 + 10] == pytest.approx(new)


def test_what_passes_in_less_than_half_a_window_changes_nothing():
    rows = fed([2.0] * 30 + [0.6] * 7 + [2.0] * 30)
    np.testing.assert_array_equal(rows[30:], np.tile(limits_at(CONFIG, 2.0), (37, 1)))


def test_ranges_that_waver_within_the_hysteresis_do_not_move_the_limits():
    rng = np.random.default_rng(0)
    rows = fed(2.0 + rng.uniform(-0.045, 0.045, 200))
    assert len(np.unique(rows[20:], axis=0)) == 1


def test_forward_motion_predicts_the_range_between_scans_and_without_lag():
    exact = PitchLimits(CONFIG)
    for k in range(50):
        exact.update(START_NS + k * SCAN_NS, np.full(100, 4.0 - 0.04 * k))
        exact.limits(START_NS + k * SCAN_NS)
        assert exact.range == pytest.approx(4.0 - 0.04 * k)
        exact.add_motion(0.02)
        exact.limits(START_NS + k * SCAN_NS + SCAN_NS // 2)
        assert exact.range == pytest.approx(4.0 - 0.04 * k - 0.02)
        exact.add_motion(0.02)


def test_a_range_that_has_not_been_seen_for_a_window_is_no_longer_predicted():
    limits = PitchLimits(CONFIG)
    limits.update(START_NS, np.full(100, 2.0))
    for k in range(100):
        limits.limits(START_NS + k * SCAN_NS)
        limits.add_motion(0.05)
    assert limits.range == pytest.approx(2.0 - 16 * 0.05)


def test_driving_back_and_through_a_wall_stays_finite():
    limits = PitchLimits(CONFIG)
    limits.update(START_NS, np.full(100, 1.0))
    limits.add_motion(3.0)
    limits.limits(START_NS)
    assert limits.range == 0.0
    limits.add_motion(-4.0)
    limits.limits(START_NS)
    assert limits.range == 2.0


def test_floor_ceiling_what_is_beside_and_what_is_nowhere_do_not_count():
    points = np.array(
        [
            (1.0, 0.0, 1.0),
            (2.0, 0.5, 0.5),
            (1.0, 0.0, 0.0),
            (1.0, 0.0, 2.5),
            (0.1, 1.0, 1.0),
            (-1.0, 0.0, 1.0),
            (np.inf, 0.0, 1.0),
            (np.nan, 0.0, 1.0),
        ]
    )
    expected = [1.0, math.hypot(2.0, 0.5)]
    np.testing.assert_allclose(ranges_that_count(CONFIG, points), expected)


@pytest.mark.parametrize(
    ('key', 'changes'),
    [
        ('band_top', {'band_top': 0.1}),
        ('pitch_max', {'pitch_max': -0.7}),
        ('limits_rate', {'limits_rate': 0.0}),
        ('limits_rate', {'limits_rate': math.nan}),
        ('mount_tilt', {'mount_tilt': (0.1,)}),
        ('mount_tilt', {'mount_tilt': (0.1, 0.2, 0.3)}),
    ],
)
def test_what_does_not_go_together_is_named(key, changes):
    with pytest.raises(ParameterError, match=f"'{key}'"):
        check(PitchLimitsConfig(**changes))


def test_time_does_not_go_back_and_motion_is_finite():
    limits = PitchLimits(CONFIG)
    limits.update(START_NS, np.full(100, 1.0))
    limits.limits(START_NS)
    with pytest.raises(ParameterError, match="'time_ns'"):
        limits.update(START_NS - 1, np.full(100, 1.0))
    with pytest.raises(ParameterError, match="'time_ns'"):
        limits.limits(START_NS - 1)
    with pytest.raises(ParameterError, match="'forward'"):
        limits.add_motion(math.nan)


def drive(scenes, *, speed=0.0, start_x=0.0):
    """Drive through scenes, one for each scan; return distance driven and limits, shape (n, 3).

    Each scan is seen with the limits that the ones before it gave: the loop is closed.
    """
    limits, rows = PitchLimits(CONFIG), []
    for k, scene in enumerate(scenes):
        now_ns = START_NS + k * SCAN_NS
        low, high = limits.limits(now_ns)
        nod = Nod(low, high, SWEEP, 4001, START_NS)
        there = dataclasses.replace(
            scene, base_start=(start_x + speed * k * 0.1, 0.0, 0.0), base_velocity=(speed, 0.0)
        )
        recording = simulate(there, nod, 0.1, start_ns=now_ns)
        limits.update(now_ns + SCAN_NS, ranges_that_count(CONFIG, seen(recording)))
        limits.add_motion(speed * 0.1)
        rows.append((speed * (k + 1) * 0.1, *limits.limits(now_ns + SCAN_NS)))
    return np.array(rows)


def seen(recording):
    """Return x, y of the sensor and height above the floor, of the first scan's beams, (n, 3)."""
    ranges, pitch = recording.ranges[0], recording.true_pitch[0]
    azimuth, arm = recording.azimuth, 0.08
    kept = np.isfinite(ranges)
    r, pitch, azimuth = ranges[kept], pitch[kept], azimuth[kept]
    ahead = r * np.cos(azimuth)
    x = ahead * np.cos(pitch) - arm * np.sin(pitch)
    z = ahead * np.sin(pitch) + arm * np.cos(pitch)
    return np.stack([x, r * np.sin(azimuth), z + 1.0], axis=1)


def test_on_the_way_to_a_wall_the_band_stays_covered():
    """Half the sector is 30 deg: the median range of a wall is its distance / cos 15 deg."""
    rows = drive([load_scene('wall', ideal=True)] * 75, speed=0.4, start_x=-2.5)[20:]
    distance = (2.0 + 2.5 - rows[:, 0]) / math.cos(math.radians(15.0))
    expected = np.array([limits_at(CONFIG, d) for d in distance])
    np.testing.assert_allclose(rows[:, 1:], expected, rtol=HYSTERESIS, atol=0.02)
    free = expected[:, 1] < CONFIG.pitch_max
    assert free.sum() > 30
    top = distance * np.tan(rows[:, 2]) + CONFIG.sensor_height
    np.testing.assert_allclose(top[free], CONFIG.band_top, atol=0.08)


HALL = """
objects:
  floor:
    shapes:
      - plane: {point: [0.0, 0.0, 0.0], normal: [0.0, 0.0, 1.0]}
  wall:
    shapes:
      - box: {pose: [2.05, 2.5, 1.25, 0, 0, 0], size: [0.1, 4.1, 2.5]}
      - box: {pose: [2.05, -2.5, 1.25, 0, 0, 0], size: [0.1, 4.1, 2.5]}
  behind:
    shapes:
      - plane: {point: [5.0, 0.0, 0.0], normal: [-1.0, 0.0, 0.0]}
"""
DOOR = """
  door:
    shapes:
      - box: {pose: [2.05, 0.0, 1.0, 0, 0, 0], size: [0.1, 0.9, 2.0]}
"""


def person(y):
    return f"""
  person:
    shapes:
      - cylinder: {{pose: [0.8, {y}, 0.9, 0, 0, 0], radius: 0.25, length: 1.8}}
"""


def test_a_door_that_opens_hardly_matters():
    closed, opened = parse_scene(HALL + DOOR, 'closed'), parse_scene(HALL, 'opened')
    rows = drive([closed] * 25 + [opened] * 30)
    before, after = rows[24, 1:], rows[-1, 1:]
    assert before == pytest.approx(limits_at(CONFIG, 2.0 / math.cos(math.radians(15.0))), abs=0.02)
    # What is left of the wall lies at up to 30 deg.
    furthest = limits_at(CONFIG, 2.0 / math.cos(math.radians(30.0)))
    assert (np.abs(after) >= np.abs(furthest) - 1e-9).all()
    assert (np.abs(after) <= np.abs(before) + 1e-9).all()


def test_a_person_who_walks_by_does_not_matter():
    """At 1 m/s, 0.8 m ahead, the person hides more than half of the sector for some scans."""
    empty = parse_scene(HALL + DOOR, 'empty')
    walk = [parse_scene(HALL + DOOR + person(-1.5 + 0.1 * k), f'walk{k}') for k in range(30)]
    hidden = [np.median(ranges_that_count(CONFIG, seen(one_scan(scene)))) < 1.0 for scene in walk]
    assert any(hidden)
    rows = drive([empty] * 25 + walk + [empty] * 10)
    before = rows[24, 1:]
    np.testing.assert_allclose(rows[25:, 1:], np.tile(before, (40, 1)), atol=1e-12)


def one_scan(scene):
    nod = Nod(-0.4, 0.4, SWEEP, 4001, START_NS - round(SWEEP / 2 * S))
    return simulate(scene, nod, 0.1, start_ns=START_NS)
