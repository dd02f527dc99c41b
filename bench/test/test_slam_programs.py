"""The SLAM programs of docs/slam.md that PyPI has, on a drive through the room."""

import pytest

from bench.maps.slam import drive, followed, USES

DURATION = 12.0


@pytest.fixture(scope='module')
def drives():
    return drive('room', 'figure_of_eight', DURATION, seed=1)


@pytest.fixture(scope='module')
def odometry_error(drives):
    return followed(*drives, USES['odometry alone']).error


@pytest.mark.parametrize(
    ('package', 'use'),
    [
        ('kiss_icp', 'kiss-icp, odometry as prior, 4 sweeps'),
        ('small_gicp', 'small_gicp to a submap, 4 sweeps'),
        ('nodlidar_mapper', 'nodlidar_mapper'),
    ],
)
def test_programs_with_odometry_as_prior_follow_the_robot(drives, odometry_error, package, use):
    pytest.importorskip(package)
    error = followed(*drives, USES[use]).error
    assert error < 0.01
    assert error < odometry_error / 2.0


def test_kiss_icp_as_its_node_does_not_follow_clouds_of_one_sweep(drives, odometry_error):
    pytest.importorskip('kiss_icp')
    assert followed(*drives, USES['kiss-icp, as its node']).error > odometry_error
