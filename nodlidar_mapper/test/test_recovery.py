"""A robot that is lost: odometry jumps, somebody carries it, rooms look alike."""

from copy import deepcopy
from functools import cache

from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import between, inverse, moved, planar
from nodlidar_mapper.geometry.surface import Surface, surface_of
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.recovery.place_search import Area, best_place, clear_share
from nodlidar_mapper.recovery.range_image import RangeImage
from nodlidar_mapper.recovery.recovery import Guess, Recovery
import numpy as np
import pytest
from rooms import cloud, CROOKED, HALL, keyframe_of, OBLONG, seen_from_origin

NS = 10**9
JUMPS = [(0.6, 0.0, 0.0), (0.0, 0.5, 0.3), (5.0, -3.0, 2.0), (0.0, 0.0, 3.1)]


def mapped(corners, **parameters):
    """Return a mapper that has seen a room from its middle on, and the last pose."""
    return deepcopy(mapped_once(tuple(map(tuple, corners)), **parameters))


@cache
def mapped_once(corners, **parameters):
    mapper = Mapper(MapConfig(**parameters))
    for k in range(6):
        pose = planar(0.2 * k, 0.0, 0.05 * k)
        found = mapper.add(Cloud(k * NS, cloud(np.array(corners), pose, seed=k), pose))
    assert not found.lost
    return mapper, pose


@pytest.mark.parametrize('jump', JUMPS)
def test_a_jump_of_odometry_does_not_carry_the_robot_away(jump):
    mapper, pose = mapped(CROOKED)
    after = planar(*jump) @ pose
    for k in range(6, 10):
        here = planar(0.2 * k, 0.0, 0.05 * k)
        odometry = after @ inverse(pose) @ here
        found = mapper.add(Cloud(k * NS, cloud(CROOKED, here, seed=k), odometry))
        assert not found.lost
        np.testing.assert_allclose(found.pose, here, atol=0.02)
        np.testing.assert_allclose(found.map_from_odometry @ odometry, here, atol=0.02)


@pytest.mark.parametrize('points', [np.zeros((0, 3)), np.full((9, 3), np.nan)])
def test_a_cloud_without_points_is_named_and_the_next_one_is_matched(points):
    mapper, pose = mapped(CROOKED)
    assert 'the cloud has no usable points' in mapper.add(Cloud(6 * NS, points, pose)).lost
    assert not mapper.add(Cloud(7 * NS, cloud(CROOKED, pose, seed=7), pose)).lost


def test_a_bent_cloud_is_not_believed_though_half_of_it_fits():
    """As one taken while the wheels of a turning robot did not count."""
    mapper, pose = mapped(CROOKED, least_clear=0.05)
    points = cloud(CROOKED, pose, seed=6)
    around = np.argsort(np.arctan2(points[:, 1], points[:, 0]))
    parts = np.array_split(points[around], 5)
    bent = [moved(planar(0.1 * k, 0.0, 0.2 * k), part) for k, part in enumerate(parts)]
    found = mapper.add(Cloud(6 * NS, np.concatenate(bent), pose))
    assert found.share > MapConfig().least_share
    assert 'is usual' in found.lost
    assert not mapper.add(Cloud(7 * NS, cloud(CROOKED, pose, seed=7), pose)).lost


@pytest.mark.parametrize('times', [0.5, 0.7, 1.5, 2.0])
def test_odometry_that_counts_turns_wrong_leaves_no_robot_lost(times):
    """A turn of 0.6 rad in each cloud, of which odometry has `times` as much for three clouds."""
    mapper, here = mapped(CROOKED)
    odometry, rng = here, np.random.default_rng(1)
    for k in range(6, 12):
        turn = 0.6 * (times if k < 9 else 1.0)
        here, odometry = here @ planar(0.0, 0.0, 0.6), odometry @ planar(0.0, 0.0, turn)
        points = cloud(CROOKED, here, seed=k)
        age = rng.uniform(0.0, 1.0, len(points))
        bent = [
            moved(planar(0.0, 0.0, a * (0.6 - turn)), point[None])[0]
            for a, point in zip(age, points, strict=True)
        ]
        found = mapper.add(Cloud(k * NS, np.array(bent), odometry, age=age))
        assert not found.lost
        distance, off = between(found.pose, here)
        assert distance < 0.02
        assert off < 0.01


def test_wheels_that_turn_on_the_spot_do_not_carry_the_robot_away():
    """Odometry goes on for 1 m, and bends each cloud by the 0.25 m that it goes meanwhile."""
    mapper, pose = mapped(CROOKED)
    rng = np.random.default_rng(1)
    for k in range(6, 14):
        slip = 0.25 if k < 10 else 0.0
        odometry = pose @ planar(0.25 * min(k - 5, 4), 0.0, 0.0)
        points = cloud(CROOKED, pose, seed=k)
        age = rng.uniform(0.0, 1.0, len(points))
        bent = points - age[:, None] * [slip, 0.0, 0.0]
        found = mapper.add(Cloud(k * NS, bent, odometry, age=age))
        assert not found.lost
        assert between(found.pose, pose)[0] < 0.02
    assert between(found.pose, pose)[0] < 0.01


def test_a_robot_that_was_carried_is_lost_until_it_is_found():
    mapper, pose = mapped(CROOKED)
    before = mapper.add(Cloud(6 * NS, cloud(CROOKED, pose, seed=6), pose))
    size = mapper.map.points
    true = planar(-2.0, -1.0, 2.5)
    found = []
    for k in range(7, 17):
        found.append(mapper.add(Cloud(k * NS, cloud(CROOKED, true, seed=k), pose)))
        if not found[-1].lost:
            break
        assert 'free' in found[-1].lost or 'lie on' in found[-1].lost
        np.testing.assert_array_equal(found[-1].map_from_odometry, before.map_from_odometry)
        assert mapper.map.points == size
    assert 1 < len(found) < 10
    np.testing.assert_allclose(found[-1].pose, true, atol=0.02)


def test_a_carried_robot_is_found_however_far_odometry_has_counted():
    """Two searches differ by milliradians, which are metres where odometry began."""
    mapper = Mapper(MapConfig())
    began = planar(3000.0, 0.0, 1.0)
    for k in range(12):
        here = planar(0.2 * k, 0.0, 0.05 * k) if k < 6 else planar(-2.0, -1.0, 2.5)
        counted = began @ planar(0.2 * min(k, 5), 0.0, 0.05 * min(k, 5))
        found = mapper.add(Cloud(k * NS, cloud(CROOKED, here, seed=k, noise=0.02), counted))
    assert not found.lost
    in_room = inverse(mapper.map.keyframes[0].pose) @ found.pose
    np.testing.assert_allclose(in_room, here, atol=0.03)


def test_in_a_room_that_fits_itself_turned_nobody_knows():
    mapper, pose = mapped(OBLONG)
    carried = planar(2.0, 1.0, np.pi / 2.0)
    for k in range(6, 11):
        found = mapper.add(Cloud(k * NS, cloud(OBLONG, carried, seed=k), pose))
        assert found.lost
    assert 'two places fit alike' in found.lost


@pytest.mark.parametrize(('corners', 'lost'), [(OBLONG, 'two places fit alike'), (CROOKED, '')])
def test_after_a_jump_in_a_long_pause_the_robot_may_be_anywhere(corners, lost):
    """As when the computer of the robot started anew: it may have turned around meanwhile."""
    mapper, pose = mapped(corners)
    odometry = planar(300.0, 0.0, 0.0)
    for k in (20, 21):
        found = mapper.add(Cloud(k * NS, cloud(corners, pose, seed=k), odometry))
    assert lost in found.lost
    assert lost or not found.lost


def test_odometry_says_nothing_of_the_place_in_a_saved_map():
    saved, _ = mapped(OBLONG)
    mapper = Mapper(MapConfig(), saved.map.keyframes, saved.map.edges)
    for k in range(3):
        here = planar(0.3 + 0.1 * k, 0.2, 0.1)
        turned = planar(0.0, 0.0, np.pi) @ here  # the room looks the same from there
        assert mapper.add(Cloud(k * NS, cloud(OBLONG, turned, seed=k), here)).lost


def in_hall(x, seed):
    """Return a pose in the middle of the hall, and what is seen within 3.5 m."""
    pose = planar(x, 0.0, 0.0)
    return pose, cloud(HALL, pose, seed=seed, count=10_000, reach=3.5)


@cache
def hall():
    """Return the mapper of a robot that drove through the hall."""
    mapper = Mapper(MapConfig())
    for k, x in enumerate(np.arange(1.5, 21.0, 0.5)):
        pose, points = in_hall(x, seed=k)
        found = mapper.add(Cloud(k * NS, points, pose))
    assert not found.lost
    np.testing.assert_allclose(found.pose, pose, atol=0.03)
    return mapper


def lost_in_hall():
    """Return a mapper of the hall in which the robot may be anywhere, and the end of its drive.

    Each single view of an end, of a niche, or of both walls, is seen at two places.
    """
    saved = hall()
    mapper = Mapper(MapConfig(), saved.map.keyframes, saved.map.edges)
    driven = [found_in_hall(mapper, k, 2.0 + 0.5 * k, planar(-7.0, 3.0, 2.0)) for k in range(7)]
    assert all(each.lost for each in driven)
    return mapper


def found_in_hall(mapper, k, x, start):
    """Return the estimate of a place along the hall, whose odometry began elsewhere."""
    pose, points = in_hall(x, seed=100 + k)
    return mapper.add(Cloud(k * NS, points, start @ pose))


def test_of_places_that_look_alike_the_way_between_them_tells_which_one_it_is():
    mapper = lost_in_hall()
    found = [found_in_hall(mapper, k, 2.0 + 0.5 * k, planar(-7.0, 3.0, 2.0)) for k in range(7, 18)]
    assert not found[-1].lost
    np.testing.assert_allclose(found[-1].pose, planar(10.5, 0.0, 0.0), atol=0.03)


def test_what_was_seen_before_a_robot_was_carried_is_forgotten_on_the_way():
    """From between plain walls to between others: neither clouds nor odometry show it."""
    mapper = lost_in_hall()
    carried = planar(-7.0, 3.0, 2.0) @ planar(5.0 - 11.5, 0.0, 0.0)
    found = [found_in_hall(mapper, k, min(8.0 + 0.5 * k, 20.5), carried) for k in range(7, 28)]
    assert not found[-1].lost
    np.testing.assert_allclose(found[-1].pose, planar(20.5, 0.0, 0.0), atol=0.03)


def test_a_room_that_fits_by_nine_tenths_may_be_another_one():
    """It has a niche of 2.2 m in 27 m of walls, which the room of the map has not."""
    saved, _ = mapped(CROOKED)
    mapper = Mapper(MapConfig(), saved.map.keyframes, saved.map.edges)
    for k in range(8):
        points = cloud(CROOKED, planar(0.0, 0.0, 0.0), seed=k)
        points[(points[:, 1] < -2.0) & (np.abs(points[:, 0]) < 1.1), 1] -= 0.8
        found = mapper.add(Cloud(k * NS, points, planar(3.0, 0.0, 1.0)))
        assert '95% must' in found.lost or 'soon' in found.lost


def floor(*below):
    """Return rows of points on a floor 1 m below the lidar, at angles below the level [deg]."""
    angle, azimuth = np.meshgrid(np.radians(below), np.linspace(-np.pi, np.pi, 180))
    away = 1.0 / np.tan(angle.ravel())
    x, y = away * np.cos(azimuth.ravel()), away * np.sin(azimuth.ravel())
    return np.column_stack([x, y, -np.ones(len(x))])


def test_beams_go_over_a_floor_not_through_it():
    """Between two rows of a keyframe, the floor is 0.4 m nearer than the farther row."""
    keyframe = keyframe_of(floor(14.2, 20.0, 26.0))
    points = floor(15.7, 15.8)
    assert clear_share(points, np.eye(4), [keyframe]) < 0.8
    on = np.ones(len(points), dtype=np.bool_)
    assert clear_share(points, np.eye(4), [keyframe], on) == 1.0
    assert clear_share(points, np.eye(4), [keyframe], ~on) < 0.8


def test_points_in_free_space_are_counted():
    mapper, pose = mapped(CROOKED)
    points = cloud(CROOKED, pose, seed=9)
    assert clear_share(points, pose, mapper.map.keyframes) > 0.99
    # Half of the points come nearer by 1 m: beams of the keyframes went through there.
    nearer = points.copy()
    ranges = np.linalg.norm(points[::2, :2], axis=1, keepdims=True)
    nearer[::2, :2] *= 1.0 - 1.0 / ranges
    nearer[::2, 2] *= 1.0 - 1.0 / ranges[:, 0]
    assert clear_share(nearer, pose, mapper.map.keyframes) == pytest.approx(0.5, abs=0.05)


def floor_and_ceiling(first):
    """Return what a lidar 1 m above a floor and below a ceiling sees by rows 2 degrees apart."""
    slopes = np.radians(np.arange(first, 30.0, 2.0))
    azimuth, slope = np.meshgrid(np.radians(np.arange(-60.0, 60.0)), np.append(slopes, -slopes))
    far = 1.0 / np.abs(np.tan(slope))
    points = np.stack([far * np.cos(azimuth), far * np.sin(azimuth), np.sign(slope)], axis=-1)
    return points.reshape(-1, 3)


def test_a_floor_far_away_is_not_seen_through_between_its_rows():
    """The rows of two clouds hit the floor up to 30 m away, metres apart."""
    before, after = floor_and_ceiling(2.0), floor_and_ceiling(3.0)
    keyframe = keyframe_of(before, surface=Surface(before, np.zeros_like(before)))
    clear = clear_share(after, planar(0.0, 0.0, 0.0), [keyframe])
    assert clear > MapConfig().least_clear


def test_a_floor_nearby_is_not_seen_through_either():
    """Beams of both clouds share a bin; over a bare floor they end up to 1 m apart."""
    steep = [floor_and_ceiling(first) for first in (12.1, 13.9)]
    before, after = (points[points[:, 2] < 0.0] for points in steep)
    keyframe = keyframe_of(before, surface=Surface(before, np.zeros_like(before)))
    assert clear_share(after, np.eye(4), [keyframe]) == 1.0


def test_nobody_is_found_on_a_bare_floor():
    """It fits wherever it is."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-6.0, 6.0, (2, 8000))
    points = np.column_stack([x, y, rng.normal(-1.0, 0.005, len(x))])
    seen = seen_from_origin(points)
    keyframe = keyframe_of(points, surface=surface_of(seen, seen))
    here = seen_from_origin(points[np.hypot(x, y) < 4.0])
    guess = Guess(planar(0.2, 0.0, 0.1), np.eye(6) * 1e-4, False, False)
    found = Recovery(MapConfig()).search(here, guess, guess.pose, [keyframe])
    assert isinstance(found, str)
    assert 'floor' in found


@pytest.mark.parametrize(('off', 'found'), [(0.1, True), (3.0, False)])
def test_far_from_where_odometry_is_certain_a_room_like_another_one_is_not_believed(off, found):
    """Nine tenths of the points lie on the map."""
    mapper, _ = mapped(CROOKED)
    points = cloud(CROOKED, planar(0.0, 0.0, 0.0), seed=50)
    points[(points[:, 1] < -2.0) & (np.abs(points[:, 0]) < 1.1), 1] -= 0.8
    guess = Guess(planar(0.2, 0.0, 0.1), np.eye(6) * off**2, False, False)
    recovery = Recovery(MapConfig())
    result = recovery.search(seen_from_origin(points), guess, guess.pose, mapper.map.keyframes)
    assert isinstance(result, str) != found


@pytest.mark.parametrize('seed', range(4))
def test_a_place_is_found_from_far_off(seed):
    rng = np.random.default_rng(seed)
    mapper, _ = mapped(CROOKED)
    true = planar(*rng.uniform(-1.5, 1.5, 2), rng.uniform(-np.pi, np.pi))
    area = Area(planar(*rng.uniform(-1.0, 1.0, 2), rng.uniform(-np.pi, np.pi)), 6.0, np.pi)
    place = best_place(
        seen_from_origin(cloud(CROOKED, true, seed=100 + seed)),
        mapper.map.keyframes,
        area,
        MapConfig(),
    )
    distance, turn = between(place.found.pose, true)
    assert distance < 0.02
    assert turn < 0.01
    assert place.fit > 0.95
    assert place.rival < 0.85 * place.fit


def test_an_empty_map_has_no_place():
    assert (
        best_place(
            seen_from_origin(np.zeros((0, 3))),
            mapped(CROOKED)[0].map.keyframes,
            Area(np.eye(4), 1.0, 1.0),
            MapConfig(),
        )
        is None
    )


AWAY = planar(20.0, 0.0, 0.0)  # the next room, from that of `mapped`


def next_room(here):
    """Return a cloud of a room like the first one, which the map does not have."""
    return cloud(CROOKED, inverse(AWAY) @ here, seed=int(10 * here[0, 3]))


def test_a_robot_that_drove_on_without_clouds_is_where_odometry_says():
    mapper, _ = mapped(CROOKED)
    for k in range(30, 34):
        here = planar(0.8 + 0.68 * (k - 4), 0.0, 0.2)
        found = mapper.add(Cloud(k * NS, next_room(here), here))
        assert not found.lost
        assert found.matched == (k > 30)  # the first one by odometry alone
        np.testing.assert_allclose(found.pose, here, atol=0.02)
    assert len(mapper.map.keyframes) > 1
    across = max(mapper.map.edges, key=lambda edge: edge.relative[0, 3])
    along, sideways = np.sqrt(np.diag(np.linalg.inv(across.information))[:2])
    assert 0.02 * across.relative[0, 3] < along < sideways  # by the heading


@pytest.mark.parametrize('silence', [4.0, 25.0])
@pytest.mark.parametrize('off', [(3.0, -2.0, 1.0), (0.0, 0.0, 0.0)])
def test_after_a_silence_of_odometry_the_place_is_as_uncertain_as_its_duration_allows(
    silence, off
):
    """The robot drives on; odometry may have begun anew, and counts from elsewhere."""
    here = planar(18.5, 0.0, 0.2)
    odometry = planar(*off) @ here

    def found(seconds):
        mapper, _ = mapped(CROOKED)
        assert not mapper.add(Cloud(30 * NS, next_room(here), odometry, silence=seconds)).lost
        return mapper.add(Cloud(31 * NS, next_room(here), odometry))

    known, unknown = found(0.0), found(silence)
    assert unknown.matched
    added = np.sqrt(np.diag(unknown.covariance - known.covariance))
    # At up to 2 m/s it may be anywhere in a disc, with any heading.
    np.testing.assert_allclose(added[[0, 1, 5]], [silence, silence, np.pi / 3.0**0.5], rtol=0.05)
    if silence == 25.0:
        assert between(unknown.pose, here)[0] < 3.0 * unknown.uncertainty


def test_where_the_map_shows_the_robot_a_silence_of_odometry_leaves_no_doubt():
    mapper, pose = mapped(CROOKED)
    for k in range(30, 34):
        found = mapper.add(Cloud(k * NS, cloud(CROOKED, pose, seed=k), pose, silence=20.0))
        assert not found.lost
        np.testing.assert_allclose(found.pose, pose, atol=0.02)
        assert found.uncertainty < 0.02


def test_clouds_that_show_nothing_real_do_not_take_the_robot_to_a_room_that_looks_alike():
    mapper, _ = mapped(CROOKED)
    rng = np.random.default_rng(2)
    for k in range(6, 30):
        here = planar(0.68 * (k - 4), 0.0, 0.2)
        assert mapper.add(Cloud(k * NS, rng.uniform(-1.5, 1.5, (4000, 3)), here)).lost
    for k in range(30, 50):
        here = planar(0.68 * 26 + 0.05 * (k - 30), 0.0, 0.2)
        found = mapper.add(Cloud(k * NS, next_room(here), here))
        assert found.lost
    back = planar(0.5, 0.3, 0.1)
    for k in range(90, 96):
        found = mapper.add(Cloud(k * NS, cloud(CROOKED, back, seed=k), back))
    assert not found.lost
    np.testing.assert_allclose(found.pose, back, atol=0.02)


@pytest.mark.parametrize('turn', [0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi])
def test_beside_a_post_nothing_is_seen_through_in_any_direction(turn):
    """The post is in one bin of directions, and a far wall in the next one."""
    sides = np.array([[np.cos(angle), np.sin(angle), 0.0] for angle in (-0.02, 0.02)])
    to_either_side = moved(planar(0.0, 0.0, turn), sides)
    image = RangeImage(to_either_side * [[1.0], [5.0]])
    assert image.beyond(to_either_side[1:]) == pytest.approx(0.0)
