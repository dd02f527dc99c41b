"""Two sensors on one robot, which look to different sides, feed one map."""

from dataclasses import replace
from itertools import pairwise

from nodlidar_assembler.bags.read_bag import read_drive
from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.nod import Nod
from nodlidar_common.pose import Pose
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import inverse, moved, planar
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.offline import odometry_at
from nodlidar_mapper.output.lasting import lasting_surface
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

START_NS = 10**18
CONFIG = PROFILES['slam']
DURATION = 10.0  # most of a circle of the figure of eight
MOUNTS = {'front': (0.2, 0.0, 1.0, 0.0), 'back': (-0.3, 0.1, 0.9, 0.75 * np.pi)}  # x y z yaw


def mount_of(name):
    """Return the pose of a sensor in base_link, as a matrix."""
    x, y, z, yaw = MOUNTS[name]
    raised = np.eye(4)
    raised[2, 3] = z
    return planar(x, y, yaw) @ raised


def recorded(name):
    """Return what a sensor and odometry record on the drive; the latter is the same for all."""
    x, y, z, yaw = MOUNTS[name]
    scene = load_scene('room', 'figure_of_eight')
    effects = replace(scene.effects, odometry_error=0.004, wheel_slip=0.02)
    mounted = replace(scene, effects=effects, mount=Pose.from_xyzrpy((x, y, z, 0.0, 0.0, yaw)))
    n_s = CONFIG.samples_per_sweep
    # The nods of the two are not in phase, so their clouds come in turn.
    begin_ns = START_NS - (0 if name == 'front' else 300_000_000)
    nod = Nod(CONFIG.pitch_min, CONFIG.pitch_max, n_s / 10240, n_s, begin_ns)
    return simulate(mounted, nod, DURATION, 3, start_ns=START_NS)


@pytest.fixture(scope='module')
def recordings():
    return {name: recorded(name) for name in MOUNTS}


@pytest.fixture(scope='module')
def clouds(recordings, tmp_path_factory):
    """Return stamp, sensor, points and odometry of all clouds, in the order of their stamps."""
    found = []
    for name, recording in recordings.items():
        bag = tmp_path_factory.mktemp(name) / 'bag'
        write_bag(recording, bag)
        log = read_drive(bag, CONFIG)
        found += [
            (cloud.stamp_ns, name, cloud.xyz, odometry_at(log, cloud.stamp_ns))
            for cloud in clouds_in(log, CONFIG)[0]
        ]
    return sorted(found, key=lambda each: each[0])


def robot_at(recording, stamp_ns):
    """Return the true pose of base_link."""
    since = recording.odometry_stamp_ns - START_NS
    return planar(
        *(np.interp(stamp_ns - START_NS, since, np.unwrap(e)) for e in recording.true_pose.T)
    )


@pytest.fixture(scope='module')
def drive(clouds):
    mapper = Mapper(MapConfig())
    found = [
        mapper.add(Cloud(stamp_ns, points, odometry, mount_of(name)))
        for stamp_ns, name, points, odometry in clouds
    ]
    return mapper, found


def test_the_robot_is_never_lost(clouds, drive):
    """The change of place from one sensor's cloud to the other's is no jump of odometry."""
    names = [name for _, name, _, _ in clouds]
    assert sum(a != b for a, b in pairwise(names)) > 20
    assert not any(each.lost for each in drive[1][1:])


def test_both_sensors_locate_the_robot_alike(recordings, drive):
    mapper, found = drive
    poses = mapper.path_of(found)
    truth = np.stack([robot_at(recordings['front'], each.stamp_ns) for each in found])
    aligned = truth[0] @ inverse(poses[0]) @ poses
    error = np.linalg.norm((aligned - truth)[:, :3, 3], axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.015
    assert error.max() < 0.03


def test_the_common_map_lies_on_the_room(recordings, clouds, drive):
    mapper, found = drive
    points = lasting_surface(mapper.map.keyframes).points
    recording = recordings[clouds[0][1]]
    begin = robot_at(recording, found[0].stamp_ns) @ mount_of(clouds[0][1])
    stamps = np.full(len(points), START_NS)
    in_world = moved(begin @ inverse(mapper.poses_of([found[0]])[0]), points)
    distance = recording.world.surface_distance_in_world(in_world, stamps)
    assert np.sqrt(np.mean(distance**2)) < 0.03
    assert len(points) > 3000
