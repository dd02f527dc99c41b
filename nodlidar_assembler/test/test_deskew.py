"""Deskewed clouds, against matrices: each point is where the robot saw it, as of one instant."""

import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_assembler.bags.point_files import OutputError
from nodlidar_assembler.bags.write_clouds import write_clouds
from nodlidar_assembler.clouds.deskew import deskewed
from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.point_layout import DESKEWED_POINT
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
import numpy as np
import pytest
from transforms3d.affines import compose
from transforms3d.quaternions import quat2mat

START_NS = 1_700_000_000_000_000_000

units = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
units = units.map(lambda q: np.array(q) / math.hypot(*q))
near = st.tuples(*[st.floats(-30, 30)] * 3).map(np.array)
robots = st.tuples(near, units)


def seen(in_odom, robot):
    """Return a point of the frame of odometry in the base frame of a robot (position, w x y z)."""
    return (np.linalg.inv(compose(robot[0], quat2mat(robot[1]), np.ones(3))) @ [*in_odom, 1.0])[:3]


def cloud(in_odom, robots):
    """Return points of the frame of odometry, each as a robot of its own instant sees it."""
    data = np.zeros(len(in_odom), dtype=DESKEWED_POINT)
    xyz = np.array([seen(*each) for each in zip(in_odom, robots, strict=True)])
    data['x'], data['y'], data['z'] = xyz.T
    data['intensity'] = data['ring'] = np.arange(len(in_odom))
    position, orientation = map(np.array, zip(*robots, strict=True))
    poses = Poses(position, np.roll(orientation, -1, axis=1))
    return Points(START_NS + np.arange(len(in_odom)) * 97_656, data, poses=poses)


@given(st.lists(st.tuples(near, robots), min_size=1, max_size=8), st.sampled_from([0, -1]))
def test_points_are_where_a_robot_of_that_instant_sees_them(drawn, k):
    in_odom, robots = zip(*drawn, strict=True)
    given = cloud(in_odom, robots)
    found = deskewed(given, {0: 'first', -1: 'last'}[k])
    assert found.stamp_ns == given.time_ns[k]
    expected = np.array([seen(each, robots[k]) for each in in_odom])
    np.testing.assert_allclose(found.xyz, expected, atol=5e-5)  # float32 at 100 m
    np.testing.assert_array_equal(found.data['intensity'], given.data['intensity'])
    assert 'time' not in found.data.dtype.names
    age_ns = given.time_ns[k] - given.time_ns
    np.testing.assert_allclose(found.data['age'], age_ns * 1e-9, rtol=1e-6)


def test_a_million_kilometres_out_a_cloud_is_as_exact():
    rng = np.random.default_rng(1)
    in_odom, here = rng.uniform(-5, 5, (50, 3)), rng.uniform(-0.5, 0.5, (50, 3))
    turns = [np.array([math.cos(a), 0.0, 0.0, math.sin(a)]) for a in np.linspace(0.0, 0.1, 50)]
    near_by, far = (
        deskewed(cloud(in_odom + shift, list(zip(here + shift, turns, strict=True)))).data
        for shift in (0.0, 2.0**30)
    )
    for axis in 'xyz':
        np.testing.assert_allclose(far[axis], near_by[axis], atol=2e-6)


def test_one_file_of_points_cannot_hold_clouds_of_several_instants(tmp_path):
    with pytest.raises(OutputError, match='deskew'):
        write_clouds(tmp_path, tmp_path / 'a.ply', AssemblerConfig(ego_motion='deskew'), Topics())
