"""Maps of simulated drives with real devices and errors of odometry, against the truth."""

from copy import deepcopy
from dataclasses import replace

from nodlidar_assembler.bags.read_bag import read_drive
from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.nod import Nod
from nodlidar_common.pose import Pose
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import inverse, moved, planar
from nodlidar_mapper.mapper import FIRST, Mapper
from nodlidar_mapper.offline import age_of, estimates, mount_of, odometry_at
from nodlidar_mapper.output.grid import FREE, grid_of, GridConfig, OCCUPIED
from nodlidar_mapper.output.lasting import lasting_surface
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.route import Leg
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest
from rooms import cloud as room_cloud
from rooms import CROOKED

START_NS, NS = 10**18, 10**9
CONFIG = PROFILES['slam']
DURATION = 26.0  # of the figure of eight [s]


def recorded(faster=1.0, mount=(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), duration=DURATION):
    """Return a recording of the figure of eight, by default of both circles."""
    scene = load_scene('room', 'figure_of_eight')
    effects = replace(scene.effects, odometry_error=0.004, wheel_slip=0.02)
    legs = tuple(
        Leg(leg.duration / faster, (leg.velocity[0] * faster, leg.velocity[1] * faster))
        for leg in scene.base_legs
    )
    scene = replace(scene, effects=effects, base_legs=legs, mount=Pose.from_xyzrpy(mount))
    n_s = CONFIG.samples_per_sweep
    nod = Nod(CONFIG.pitch_min, CONFIG.pitch_max, n_s / 10240, n_s, START_NS)
    return simulate(scene, nod, duration / faster, 3, start_ns=START_NS)


def log_of(recording, folder):
    write_bag(recording, folder / 'bag')
    return read_drive(folder / 'bag', CONFIG)


@pytest.fixture(scope='module')
def recording():
    return recorded()


@pytest.fixture(scope='module')
def log(recording, tmp_path_factory):
    return log_of(recording, tmp_path_factory.mktemp('drive'))


@pytest.fixture(scope='module')
def drive(log):
    mapper = Mapper(MapConfig())
    return mapper, estimates(mapper, clouds_in(log, CONFIG)[0], log)


def truth_at(recording, stamp_ns):
    since = recording.odometry_stamp_ns - START_NS
    pose = [
        np.interp(stamp_ns - START_NS, since, np.unwrap(each)) for each in recording.true_pose.T
    ]
    mount, of_sensor = recording.world.scene.mount, np.eye(4)
    of_sensor[:3, :3], of_sensor[:3, 3] = mount.rotation, mount.position
    return planar(*pose) @ of_sensor


def errors(recording, found, poses):
    """Return the distances of poses from the true ones, aligned at the first one [m]."""
    truth = np.stack([truth_at(recording, each.stamp_ns) for each in found])
    aligned = truth[0] @ inverse(poses[0]) @ np.stack(poses)
    return np.linalg.norm((aligned - truth)[:, :3, 3], axis=1)


def off_the_room(recording, mapper, estimate, points):
    """Return the RMS distance of points in the map from the room [m], aligned at an estimate."""
    back = truth_at(recording, estimate.stamp_ns) @ inverse(mapper.poses_of([estimate])[0])
    stamps = np.full(len(points), START_NS)
    distance = recording.world.surface_distance_in_world(moved(back, points), stamps)
    return np.sqrt(np.mean(distance**2))


def test_the_way_is_known_much_better_than_by_odometry(recording, drive, log):
    mapper, found = drive
    by_map = errors(recording, found, mapper.poses_of(found))
    by_odometry = errors(recording, found, [odometry_at(log, each.stamp_ns) for each in found])
    assert np.sqrt(np.mean(by_map**2)) < 0.012
    assert by_map.max() < 0.1 * by_odometry.max()
    assert not any(each.lost for each in found[1:])


def test_a_sensor_that_looks_back_and_down_maps_as_well(tmp_path):
    tilted = recorded(mount=(-0.2, 0.1, 0.9, 0.0, 0.4, np.pi), duration=DURATION / 2.0)
    mapper, log = Mapper(MapConfig()), log_of(tilted, tmp_path)
    found = estimates(mapper, clouds_in(log, CONFIG)[0], log)
    by_map = errors(tilted, found, mapper.poses_of(found))
    assert np.sqrt(np.mean(by_map**2)) < 0.02
    assert not any(each.lost for each in found[1:])


def test_the_first_poses_are_right_at_full_speed(tmp_path):
    fast = recorded(faster=2.0, duration=DURATION / 2.0)
    mapper, log = Mapper(MapConfig()), log_of(fast, tmp_path)
    found = estimates(mapper, clouds_in(log, CONFIG)[0], log)
    live = errors(fast, found[FIRST - 1 :], [each.pose for each in found[FIRST - 1 :]])
    final = errors(fast, found, mapper.poses_of(found))
    assert np.sqrt(np.mean(final**2)) < 0.004  # 0.008 if the first clouds are mapped once
    assert np.sqrt(np.mean(live**2)) < 0.02


def test_places_before_the_first_surface_stay_where_they_were(log):
    mapper, clouds = Mapper(MapConfig()), clouds_in(log, CONFIG)[0]
    before = []
    for cloud in clouds[:2]:
        odometry = odometry_at(log, cloud.stamp_ns)
        before.append((mapper.add(Cloud(cloud.stamp_ns, np.empty((0, 3)), odometry)), odometry))
    found = estimates(mapper, clouds[2 : FIRST + 2], log)
    for each, odometry in before:
        np.testing.assert_allclose(mapper.poses_of([each])[0], odometry, atol=0.02)
    np.testing.assert_allclose(mapper.poses_of([found[-1]])[0], found[-1].pose, atol=1e-12)


def bent(points):
    """Return a cloud as a turn that odometry did not count bends it."""
    return np.stack(
        [planar(0, 0, 0.2 * np.arctan2(y, x))[:3, :3] @ (x, y, z) for x, y, z in points]
    )


def test_a_map_that_begins_with_bent_clouds_begins_anew():
    mapper, found, poses = Mapper(MapConfig()), [], []
    for k in range(FIRST + 4):
        poses.append(planar(0.1 * k, 0.0, 0.05 * k))
        seen = room_cloud(CROOKED, poses[-1], seed=k)
        points = bent(seen) if k < 2 else seen
        found.append(mapper.add(Cloud(k * 10**9, points, poses[-1])))
    assert [bool(each.lost) for each in found] == [k in (0, 2) for k in range(FIRST + 4)]
    np.testing.assert_allclose(mapper.poses_of(found), poses, atol=0.02)
    sides = np.roll(CROOKED, -1, axis=0) - CROOKED
    inward = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    inward /= np.linalg.norm(sides, axis=1)[:, None]
    points = lasting_surface(mapper.map.keyframes).points[:, None, :2]
    off = np.abs(np.einsum('nki,ki->nk', points - CROOKED, inward)).min(axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.01  # 0.2 rad at 4 m would be 0.8 m


def test_the_pose_in_the_map_is_that_of_odometry_moved(drive, log):
    for each in drive[1]:
        moved_on = each.map_from_odometry @ odometry_at(log, each.stamp_ns)
        np.testing.assert_allclose(moved_on, each.pose, atol=1e-9)


def test_the_map_lies_on_the_room(recording, drive):
    mapper, found = drive
    points = lasting_surface(mapper.map.keyframes).points
    assert off_the_room(recording, mapper, found[0], points) < 0.025
    assert len(points) > 3000


def test_the_map_does_not_grow_where_all_was_seen(drive, log):
    mapper, found = drive
    before = len(mapper.map.keyframes), mapper.map.points
    again = deepcopy(mapper)
    last = odometry_at(log, found[-1].stamp_ns)
    cloud = clouds_in(log, CONFIG)[0][-1]
    for k in range(1, 31):
        stamp_ns = cloud.stamp_ns + k * NS
        assert not again.add(Cloud(stamp_ns, cloud.xyz, last, mount_of(log), age_of(cloud))).lost
    after = len(again.map.keyframes), again.map.points
    assert after[0] <= before[0] + 1
    assert after[1] < 1.1 * before[1]


def test_clouds_of_another_place_are_not_believed(recording, log):
    clouds, mapper = clouds_in(log, CONFIG)[0], Mapper(MapConfig())
    for cloud in clouds[:15]:
        good = mapper.add(Cloud(cloud.stamp_ns, cloud.xyz, odometry_at(log, cloud.stamp_ns)))
    keyframes = len(mapper.map.keyframes)
    noise = np.random.default_rng(1).uniform(-3.0, 3.0, (3000, 3))
    for cloud in clouds[15:18]:
        odometry = odometry_at(log, cloud.stamp_ns)
        bad = mapper.add(Cloud(cloud.stamp_ns, noise, odometry))
        assert 'lie on it' in bad.lost
        np.testing.assert_allclose(bad.map_from_odometry, good.map_from_odometry, atol=0.02)
    assert len(mapper.map.keyframes) == keyframes
    for cloud in clouds[18:22]:
        odometry = odometry_at(log, cloud.stamp_ns)
        assert not mapper.add(Cloud(cloud.stamp_ns, cloud.xyz, odometry)).lost
    points = lasting_surface(mapper.map.keyframes).points
    assert off_the_room(recording, mapper, good, points) < 0.025  # none of the noise


def test_the_grid_is_free_along_the_way_and_occupied_at_the_walls(recording, drive):
    mapper, found = drive
    surface = lasting_surface(mapper.map.keyframes)
    grid = grid_of(surface, mapper.map.keyframes, GridConfig())

    def cell(x, y):
        column, row = np.floor((np.array([x, y]) - grid.origin) / grid.resolution).astype(int)
        return grid.cells[row, column]

    for each in found:
        assert cell(*mapper.poses_of([each])[0][:2, 3]) == FREE
    to_map = mapper.poses_of([found[0]])[0] @ inverse(truth_at(recording, found[0].stamp_ns))
    walls = [(3.2, y, 1.0) for y in np.arange(-2.0, 2.0, 0.1)]
    walls += [(x, -2.8, 1.0) for x in np.arange(-2.0, 2.0, 0.1)]
    seen = [
        any(cell(x + dx, y + dy) == OCCUPIED for dx in (-0.05, 0, 0.05) for dy in (-0.05, 0, 0.05))
        for x, y, _ in moved(to_map, np.array(walls))
    ]
    assert np.mean(seen) > 0.8


@pytest.mark.parametrize('first', [np.empty((0, 3)), np.full((50, 3), np.nan), np.ones((1, 3))])
def test_first_clouds_with_nothing_to_match_do_not_matter(log, first):
    mapper = Mapper(MapConfig())
    clouds = clouds_in(log, CONFIG)[0]
    for cloud in clouds[:2]:
        odometry = odometry_at(log, cloud.stamp_ns)
        assert mapper.add(Cloud(cloud.stamp_ns, first, odometry)).lost == 'no map yet'
    found = estimates(mapper, clouds[2:8], log)
    assert found[0].lost == 'no map yet'
    assert not any(each.lost for each in found[1:])
    assert not np.isnan(found[-1].pose).any()


@pytest.mark.parametrize('freedom', ['planar', 'spatial'])
def test_where_the_sensor_is_mounted_does_not_change_how_certain_the_robot_is(freedom):
    """The same points in the frame of the robot, and in one 0.5 m ahead that is turned."""
    mount = planar(0.5, -0.1, 0.4)
    config = MapConfig(freedom=freedom)
    mounted, plain = Mapper(config), Mapper(config)
    for k in range(8):
        pose = planar(0.15 * k, 0.0, 0.05 * k)
        points = room_cloud(CROOKED, pose, seed=k)
        there = mounted.add(Cloud(k * NS, moved(inverse(mount), points), pose @ mount, mount))
        here = plain.add(Cloud(k * NS, points, pose))
        np.testing.assert_allclose(there.pose @ inverse(mount), here.pose, atol=0.01)
        deviation = np.sqrt(np.diag(here.covariance)) + 1e-9
        off = (there.covariance - here.covariance) / np.outer(deviation, deviation)
        assert np.abs(off).max() < 0.1


def test_a_planar_pose_says_nothing_of_what_is_not_estimated():
    mapper = Mapper(MapConfig())
    for k in range(3):
        found = mapper.add(Cloud(k * NS, room_cloud(CROOKED, np.eye(4), seed=k), np.eye(4)))
    free = np.zeros(6, dtype=bool)
    free[[0, 1, 5]] = True
    assert (np.diag(found.covariance) > 0.0).tolist() == free.tolist()
    assert not found.covariance[~free].any()
    assert not found.covariance[:, ~free].any()


def test_a_robot_that_is_found_is_as_certain_as_its_sensor_shows():
    """It was carried and turned round; the sensor is 1 m ahead of it."""
    mount, true = planar(1.0, 0.0, 0.0), planar(0.5, 0.3, 2.5)
    mounted, plain = Mapper(MapConfig()), Mapper(MapConfig())
    found = []
    for mapper, place in ((mounted, mount), (plain, np.eye(4))):
        for k in range(8):
            points = moved(inverse(place), room_cloud(CROOKED, np.eye(4), seed=k))
            mapper.add(Cloud(k * NS, points, place, place))
        for k in range(8, 40):
            points = moved(inverse(place), room_cloud(CROOKED, true, seed=k))
            estimate = mapper.add(Cloud(k * NS, points, place, place))
            if not estimate.lost:
                break
        np.testing.assert_allclose(estimate.pose @ inverse(place), true, atol=0.03)
        found.append(estimate.covariance)
    there, here = found
    deviation = np.sqrt(np.diag(here)) + 1e-9
    assert np.abs((there - here) / np.outer(deviation, deviation)).max() < 0.2


def test_a_pose_is_no_more_certain_than_the_way_there():
    """Along 18 m of bare walls, odometry alone shows the way; then, the end of the corridor does.

    Odometry errs by 3 % of the way if its errors are alike all along, and if they are not, by half
    of that in each of the 36 steps.
    """
    rng = np.random.default_rng(1)
    mapper = Mapper(MapConfig())
    for k in range(44):
        here = min(0.5 * k, 18.0)
        x, z = rng.uniform((here - 5.0, 0.0), (min(here + 5.0, 21.0), 2.0), (3000, 2)).T
        walls = np.column_stack([x, rng.choice([-1.5, 1.5], 3000), z])
        end = np.column_stack([np.full(600, 21.0), rng.uniform((-1.5, 0.0), (1.5, 2.0), (600, 2))])
        points = np.concatenate([walls, end[: 600 if here > 16.0 else 0]])
        points += rng.normal(0.0, 0.005, points.shape)
        pose = planar(here, 0.0, 0.0)
        found = mapper.add(Cloud(k * NS, moved(inverse(pose), points), pose))
    along, across = np.sqrt(np.diag(found.covariance)[:2])
    assert 0.015 * 0.5 * np.sqrt(36) < along < 0.03 * 18.0
    assert across < along


@pytest.mark.parametrize(('times', 'turn'), [(3.0, 0.2), (4.0, 0.2), (4.0, 0.0)])
def test_wheels_that_slip_far_over_a_floor_are_noticed(times, turn):
    """The floor fits everywhere, and the walls are farther off than a match reaches."""
    rng = np.random.default_rng(1)
    start, odometry, mapper = planar(-2.0, -1.0, 0.2), np.eye(4), Mapper(MapConfig())
    for k in range(14):
        true = planar(0.3 * k, 0.0, 0.02 * k)
        floor = np.column_stack([rng.uniform(-3.0, 3.0, (3000, 2)), rng.normal(0.0, 0.005, 3000)])
        points = np.concatenate([room_cloud(CROOKED, start @ true, seed=k, count=800), floor])
        counted = (0.3 * times, turn) if k == 9 else (0.3, 0.0)
        if k:
            odometry = odometry @ planar(counted[0], 0.0, 0.02 + counted[1])
        found = mapper.add(Cloud(round(0.74 * k * NS), points - [0.0, 0.0, 1.0], odometry))
        assert not found.lost or k == 0
    np.testing.assert_allclose(found.pose, true, atol=0.05)
