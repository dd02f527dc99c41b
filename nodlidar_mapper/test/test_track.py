"""The pose by odometry, and how certain it is."""

from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.poses import planar
from nodlidar_mapper.track import Track
import numpy as np

NS = 10**9
YAW = 0.02  # standard deviation of the heading [rad]


def test_an_error_of_the_heading_becomes_one_of_the_place():
    track = Track(MapperConfig())
    start = planar(3.0, -1.0, np.pi / 2.0)
    track.move_to(start, 0, np.eye(4))
    track.covariance = np.diag([0.0, 0.0, 0.0, 0.0, 0.0, YAW**2])
    there = track.predicted(10 * NS, planar(10.0, 0.0, 0.0))
    np.testing.assert_allclose(there, planar(3.0, 9.0, np.pi / 2.0), atol=1e-9)
    of_place = track.covariance[:2, :2]
    # The robot drove along y: off by 10 m times the heading's error along x, by odometry in both.
    assert np.isclose(of_place[0, 0] - of_place[1, 1], (10.0 * YAW) ** 2)
    # Places that are too far along x are those of headings turned too far to the right.
    np.testing.assert_allclose(track.covariance[0, 5], -10.0 * YAW**2)
