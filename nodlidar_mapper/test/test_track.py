"""The pose by odometry, and how certain it is."""

from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import carried, inverse, moved, planar
from nodlidar_mapper.tracking.track import Track
import numpy as np
import pytest

NS = 10**9
YAW = 0.02  # standard deviation of the heading [rad]


STAMPS = {  # of clouds [s]: of one sensor, of two, and of two whose clouds come out of order
    'one': [0.7, 1.4, 2.1, 2.8, 3.5],
    'two': [0.7, 0.72, 1.4, 1.42, 2.1, 2.12, 2.8, 2.82],
    'out of order': [0.7, 0.66, 1.4, 1.36, 2.1, 2.06, 2.8, 2.76],
}


@pytest.mark.parametrize('stamps', STAMPS.values(), ids=STAMPS)
def test_where_the_lidar_was_is_known_however_the_clouds_of_sensors_follow(stamps):
    """The robot drives at 0.4 m/s; a beam that is 0.5 s old was sent 0.2 m behind."""
    track = Track(MapConfig())
    for seconds in stamps:
        pose = planar(0.4 * seconds, 0.0, 0.0)
        track.predicted(round(seconds * NS), pose)
        track.move_to(pose, round(seconds * NS), pose)
        assert not track.paused
    seen = track.seen(np.ones((1, 3)), np.array([0.5]), np.zeros(3))
    np.testing.assert_allclose(seen.origins, [[-0.2, 0.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(seen.points, [[1.0, 1.0, 1.0]], atol=1e-9)
    track.predicted(round(12.0 * NS), pose)
    assert track.paused


@pytest.mark.parametrize('stamps', STAMPS.values(), ids=STAMPS)
def test_a_track_that_begins_again_knows_the_first_speed(stamps):
    robots = [(round(t * NS), planar(0.4 * t, 0.0, 0.0)) for t in stamps]
    track = Track(MapConfig()).restarted(robots)
    track.predicted(*robots[0])
    seen = track.seen(np.ones((1, 3)), np.array([0.5]), np.zeros(3))
    np.testing.assert_allclose(seen.origins, [[-0.2, 0.0, 0.0]], atol=1e-9)


def test_clouds_that_come_more_rarely_are_no_pauses_for_long():
    track = Track(MapConfig())
    pose, paused = planar(0.0, 0.0, 0.0), []
    stamps = [0.7 * k for k in range(8)] + [5.0 + 3.0 * k for k in range(1, 8)]
    for t in stamps:
        track.predicted(round(t * NS), pose)
        track.move_to(pose, round(t * NS), pose)
        paused.append(track.paused)
    assert paused == [False] * 8 + [True] * 2 + [False] * 5


def test_a_slip_is_taken_out_of_the_points_that_it_bent():
    """Odometry goes on at 0.4 m/s and 0.5 rad/s, but from the last cloud on, the robot stands."""
    track = Track(MapConfig())
    for k in range(3):
        pose = planar(0.28 * k, 0.0, 0.0)
        track.predicted(round(0.7 * k * NS), pose)
        track.move_to(pose, round(0.7 * k * NS), pose)
    counted = planar(0.28, 0.0, 0.35)
    track.predicted(round(2.1 * NS), pose @ counted)
    slip = track.slip_to(pose)
    wall = np.array([[3.0, 2.0, 1.0]])
    age = np.array([0.7])
    # What the robot saw after the last cloud, odometry has moved and turned back.
    deskewed = moved(inverse(counted), wall)
    seen = track.seen(deskewed, age, np.zeros(3), slip)
    np.testing.assert_allclose(seen.points, wall, atol=1e-9)
    np.testing.assert_allclose(seen.origins, [[0.0, 0.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(track.seen(wall, np.zeros(1), np.zeros(3), slip).points, wall)
    older = track.seen(deskewed, 2.0 * age, np.zeros(3), slip).points
    np.testing.assert_allclose(older, wall, atol=1e-9)  # before the last cloud, nothing slipped
    # Nor is known of a slip after the instant of the cloud, if that is its first point.
    later = track.seen(wall, -age, np.zeros(3), slip)
    np.testing.assert_allclose(later.points, wall)
    np.testing.assert_allclose(later.origins, track.seen(wall, -age, np.zeros(3)).origins)


def test_every_pause_is_noticed():
    track, seconds = Track(MapConfig()), 0.0
    for pause in (0.7, 0.7, 0.7, 0.7, 0.7, 10.0, 0.7, 0.7, 10.0):
        seconds += pause
        track.predicted(round(seconds * NS), np.eye(4))
        track.move_to(np.eye(4), round(seconds * NS), np.eye(4))
        assert track.paused == (pause > 1.0)


def test_after_a_jump_of_odometry_the_speed_is_as_before():
    track = Track(MapConfig())
    for seconds, x in ((0.7, 0.28), (1.4, 0.56), (2.1, 50.0), (2.8, 50.28)):
        track.predicted(round(seconds * NS), planar(x, 0.0, 0.0))
        track.move_to(planar(x, 0.0, 0.0), round(seconds * NS), planar(x, 0.0, 0.0))
        if seconds > 1.0:
            seen = track.seen(np.ones((1, 3)), np.array([0.5]), np.zeros(3))
            np.testing.assert_allclose(seen.origins, [[-0.2, 0.0, 0.0]], atol=1e-9)


def test_a_small_robot_that_turns_on_the_spot_does_not_jump():
    """By its data sheet, a TurtleBot3 Burger turns at 2.84 rad/s; a cloud comes every 0.74 s."""
    track = Track(MapConfig())
    for k in range(4):
        pose = planar(0.0, 0.0, 2.84 * 0.74 * k)
        track.predicted(round(0.74 * k * NS), pose)
        assert not track.jump
        track.move_to(pose, round(0.74 * k * NS), pose)


def test_an_error_of_the_heading_becomes_one_of_the_place():
    start, found = planar(3.0, -1.0, np.pi / 2.0), []
    for yaw in (0.0, YAW):
        track = Track(MapConfig())
        track.move_to(start, 0, np.eye(4))
        track.covariance = np.diag([0.0, 0.0, 0.0, 0.0, 0.0, yaw**2])
        there = track.predicted(10 * NS, planar(10.0, 0.0, 0.0))
        np.testing.assert_allclose(there, planar(3.0, 9.0, np.pi / 2.0), atol=1e-9)
        found.append(track.covariance)
    more = found[1] - found[0]
    # The robot drove along y: off by 10 m times the heading's error along x.
    np.testing.assert_allclose(more[:2, :2], [[(10.0 * YAW) ** 2, 0.0], [0.0, 0.0]], atol=1e-9)
    # Places that are too far along x are those of headings turned too far to the right.
    np.testing.assert_allclose(more[0, 5], -10.0 * YAW**2)


@pytest.mark.parametrize(('freedom', 'tilts'), [('planar', False), ('spatial', True)])
def test_a_tilt_that_is_not_estimated_does_not_move_a_lidar_above_the_robot(freedom, tilts):
    track = Track(MapConfig(freedom=freedom))
    for k in range(100):
        pose = planar(0.3 * k, 0.0, 0.0)
        track.predicted(k * NS, pose)
        track.learn(pose, np.diag([1e4, 1e4, 0.0, 0.0, 0.0, 1e4]))
        track.move_to(pose, k * NS, pose)
    above = carried(track.covariance, np.array([0.0, 0.0, 1.0]))
    assert (above[0, 0] > 1.01 * track.covariance[0, 0]) == tilts


def test_wheels_that_slipped_once_are_no_lesson():
    """The pose is as uncertain as the slip was, and odometry is corrected by nothing."""
    track = Track(MapConfig())
    for k in range(20):
        pose = planar(0.3 * k, 0.0, 0.0)
        track.predicted(k * NS, pose)
        track.learn(pose, np.eye(6) * 1e6)
        track.move_to(pose, k * NS, pose)
    there = track.predicted(20 * NS, planar(0.3 * 20, 0.0, 0.0))
    before = track.covariance[0, 0]
    stood = planar(there[0, 3] - 0.3, 0.0, 0.0)
    track.learn(stood, np.zeros((6, 6)), before / 0.3**2)
    assert track.covariance[0, 0] == pytest.approx(0.3**2)
    track.move_to(stood, 20 * NS, planar(0.3 * 20, 0.0, 0.0))
    after = track.predicted(21 * NS, planar(0.3 * 21, 0.0, 0.0))
    np.testing.assert_allclose(after[0, 3] - stood[0, 3], 0.3, atol=1e-3)


def test_wheels_that_slipped_may_slip_again():
    """Odometry is 0.06 instead of 0.015 of the way off, beside 2 mm; after 500 m, as before."""
    step, variances = 0.3, []
    for prior_weight in (1.0, 1e-6):
        track = Track(MapConfig())
        track.move_to(np.eye(4), 0, np.eye(4))
        track.learn(np.eye(4), np.zeros((6, 6)), prior_weight)
        for seconds, x in ((1, step), (1000, 500.0), (1001, 500.0 + step)):
            track.covariance = np.diag([1e-6] * 6)
            track.predicted(seconds * NS, planar(x, 0.0, 0.0))
            track.move_to(planar(x, 0.0, 0.0), seconds * NS, planar(x, 0.0, 0.0))
            variances.append(track.covariance[0, 0])
    soon, _, late = np.subtract(variances[3:], variances[:3])
    assert soon == pytest.approx((0.002 + 0.06 * step) ** 2 - (0.002 + 0.015 * step) ** 2, 0.02)
    assert abs(late) < 0.001 * soon


def test_odometry_that_was_right_all_the_way_is_believed_more():
    """At first, it may miscount by a share, and turn by two thirds of it per metre.

    50 matches find no such error; what differs from motion to motion remains.
    """
    slip, step = 0.03, 0.5
    track, variances = Track(MapConfig(odometry_slip=slip)), []
    for k in range(52):
        pose = planar(step * k, 0.0, 0.0)
        known = track.covariance
        track.predicted(k * NS, pose)
        variances.append(np.diag(track.covariance - known)[[0, 5]])
        track.learn(pose, np.eye(6) * 1e6)
        track.move_to(pose, k * NS, pose)
    alike = np.array([slip * step, slip * step / 1.5]) ** 2
    np.testing.assert_allclose(variances[1] - variances[-1], alike, rtol=0.05)
