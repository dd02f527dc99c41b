"""The mapper of the node: the path, and what a person sets."""

from nodlidar_mapper import live
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.live import LiveMapper
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.output.grid import EmptyMapError, GridConfig, surface_and_grid
import numpy as np
import pytest
from rooms import cloud, CROOKED, OBLONG

NS = 10**9


def test_the_path_is_where_the_robot_was(monkeypatch):
    monkeypatch.setattr(live, 'MOST_PLACES', 20)
    mapper = LiveMapper(Mapper(MapConfig()))
    poses = [planar(0.1 * k, 0.02 * k, 0.01 * k) for k in range(60)]
    mounts = planar(0.3, 0.2, 0.1), planar(-0.3, 0.0, 3.0)  # of two sensors
    for k, pose in enumerate(poses):
        mount = mounts[k % 2]
        seen_from = pose @ mount
        snapshot = mapper.add(Cloud(k * NS, cloud(OBLONG, seen_from, seed=k), seen_from, mount))
        assert len(snapshot.path) == len(snapshot.stamps_ns) <= 20
    assert snapshot.stamps_ns[0] == 0
    assert snapshot.stamps_ns[-1] == 59 * NS
    for stamp_ns, place in zip(snapshot.stamps_ns, snapshot.path, strict=True):
        np.testing.assert_allclose(place, poses[stamp_ns // NS], atol=0.02)


def test_a_drawn_map_does_not_change_with_the_drive():
    mapper = LiveMapper(Mapper(MapConfig()))
    first = mapper.add(Cloud(0, cloud(OBLONG, np.eye(4)), np.eye(4)))
    before = surface_and_grid(first.keyframes, GridConfig())
    for k in range(1, 8):
        pose = planar(0.3 * k, 0.0, 0.0)
        mapper.add(Cloud(k * NS, cloud(OBLONG, pose, seed=k), pose))
    after = surface_and_grid(first.keyframes, GridConfig())
    np.testing.assert_array_equal(after[0].points, before[0].points)
    np.testing.assert_array_equal(after[1].cells, before[1].cells)


def test_an_empty_map_is_not_drawn():
    snapshot = LiveMapper(Mapper(MapConfig())).add(Cloud(0, np.empty((0, 3)), np.eye(4)))
    with pytest.raises(EmptyMapError):
        surface_and_grid(snapshot.keyframes, GridConfig())


@pytest.mark.parametrize('shift', [(0.2, -0.2, 0.05), (-0.3, 0.1, -0.08)])
def test_the_map_continues_where_a_person_sets_the_robot(shift):
    mapper = LiveMapper(Mapper(MapConfig()))
    for k in range(3):
        mapper.add(Cloud(k * NS, cloud(OBLONG, np.eye(4), seed=k), np.eye(4)))
    # Carried away: odometry did not notice. The person sets the pose with an error.
    true, odometry = planar(2.0, 0.7, 0.6), planar(0.0, 0.0, 0.0)
    given = true @ planar(*shift)
    mapper.place(given, 2 * NS, odometry, np.diag([0.3**2] * 3 + [0.1**2] * 3))
    found = mapper.add(Cloud(9 * NS, cloud(OBLONG, true, seed=9), odometry)).estimate
    assert not found.lost
    np.testing.assert_allclose(found.pose, true, atol=0.02)


@pytest.mark.parametrize('where', [(15.0, 0.0), (8.0, 0.0), (-14.0, 0.0)])
def test_a_map_is_not_extended_where_a_person_set_the_robot_by_mistake(where):
    mapper = LiveMapper(Mapper(MapConfig()))
    for k in range(20):
        pose = planar(0.2 * k - 2.0, 0.0, 0.0)
        before = mapper.add(Cloud(k * NS, cloud(CROOKED, pose, seed=k), pose))
    mapper.place(planar(*where, 0.0), 19 * NS, pose, np.diag([0.25] * 3 + [0.07] * 3))
    for k in range(20, 26):
        after = mapper.add(Cloud(k * NS, cloud(CROOKED, pose, seed=k), pose))
        np.testing.assert_allclose(
            after.keyframes[-1].placed_surface.points, before.keyframes[-1].placed_surface.points
        )
        assert len(after.keyframes) == len(before.keyframes)
    if not after.estimate.lost:
        np.testing.assert_allclose(after.estimate.pose, pose, atol=0.02)


def test_a_pose_that_a_person_set_stays_if_the_next_cloud_does_not_match():
    mapper = LiveMapper(Mapper(MapConfig()))
    for k in range(3):
        mapper.add(Cloud(k * NS, cloud(OBLONG, np.eye(4), seed=k), np.eye(4)))
    given, odometry = planar(2.0, 0.7, 0.6), planar(0.5, 0.0, 0.1)
    mapper.place(given, 2 * NS, odometry, np.diag([0.3**2] * 3 + [0.1**2] * 3))
    noise = np.random.default_rng(1).uniform(-3.0, 3.0, (3000, 3))
    found = mapper.add(Cloud(3 * NS, noise, odometry)).estimate
    assert found.lost
    np.testing.assert_allclose(found.map_from_odometry @ odometry, given, atol=1e-9)


def test_a_map_begins_near_its_origin_where_float32_keeps_millimetres():
    """Odometry may count from the corner of a zone of UTM."""
    far, mapper = planar(500_000.3, 5_300_000.2, 0.4), Mapper(MapConfig())
    for k in range(8):
        here = planar(0.2 * k, 0.0, 0.05 * k)
        found = mapper.add(Cloud(k * NS, cloud(CROOKED, here, seed=k), far @ here))
    assert not found.lost
    assert np.abs(found.pose[:3, 3]).max() < 8193.0
    np.testing.assert_allclose(found.map_from_odometry @ far @ here, found.pose, atol=1e-9)
