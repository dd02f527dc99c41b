"""Drawn buildings: the drive comes around, and keeps clear of all that stands there."""

from nodlidar_common.stamps import NS_PER_S
import numpy as np
import pytest

from bench.maps.drawn_buildings import drawn, KINDS, SEEDS
from bench.maps.equal_rooms import equal_rooms, HALF_WIDTH, ROOMS, WIDTH
from bench.shared.reference import START_NS

CLEARANCE = 0.25  # m
HEIGHTS = 0.4, 1.2  # m


def places_of(scene):
    """Return x, y, yaw each 0.1 s of a drive."""
    seconds = np.arange(0.0, sum(leg.duration for leg in scene.base_legs), 0.1)
    stamps = START_NS + np.round(seconds * NS_PER_S).astype(np.int64)
    return scene.route(START_NS).poses(stamps)


@pytest.mark.parametrize('seed', SEEDS)
@pytest.mark.parametrize('kind', KINDS)
def test_the_drive_keeps_clear_and_comes_around(kind, seed):
    scene = drawn(kind, seed, 0.6)
    places = places_of(scene)
    for height in HEIGHTS:
        points = np.column_stack([places[:, :2], np.full(len(places), height)])
        assert scene.surfaces.surface_distance(points).min() > CLEARANCE
    turned = np.unwrap(places[:, 2])[-1] - places[0, 2]
    assert turned > 2.0 * np.pi
    back = np.linalg.norm(places[len(places) // 2 :, :2] - places[0, :2], axis=1)
    assert back.min() < 0.1


@pytest.mark.parametrize('furniture', [0, 1])
def test_the_drive_through_equal_rooms_enters_each_and_keeps_clear(furniture):
    scene = equal_rooms(1, 0.6, furniture)
    places = places_of(scene)
    for height in HEIGHTS:
        points = np.column_stack([places[:, :2], np.full(len(places), height)])
        assert scene.surfaces.surface_distance(points).min() > CLEARANCE - 1e-9
    inside = np.abs(places[:, 1]) > HALF_WIDTH + 1.0
    x, y = places[inside, 0], places[inside, 1]
    entered = set(zip(np.floor(x / WIDTH), np.sign(y), strict=True))
    assert len(entered) == 2 * ROOMS


def test_other_furniture_stands_in_the_same_rooms():
    one, other = (equal_rooms(1, 0.6, furniture) for furniture in (0, 1))
    assert one.base_legs == other.base_legs
    x, y = np.meshgrid(np.linspace(0.1, ROOMS * WIDTH, 200), np.linspace(-4.0, 4.0, 200))
    off = [
        each.surfaces.surface_distance(np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)]))
        for each in (one, other)
        for z in (0.3, 2.4)
    ]
    assert np.abs(off[0] - off[2]).max() > 0.25  # near the floor, things differ
    np.testing.assert_allclose(off[1], off[3])  # below the ceiling, walls do not


@pytest.mark.parametrize('kind', KINDS)
def test_another_speed_drives_the_same_way(kind):
    slow, fast = (places_of(drawn(kind, 1, speed)) for speed in (0.6, 1.2))
    np.testing.assert_allclose(fast[: len(slow) // 2], slow[: 2 * (len(slow) // 2) : 2], atol=1e-6)
