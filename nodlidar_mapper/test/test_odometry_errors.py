"""The errors of odometry that matches show, and clouds without them."""

from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import change_between, inverse, moved, planar, yaw_of
from nodlidar_mapper.tracking.odometry_errors import OdometryErrors
from nodlidar_mapper.tracking.track import Track
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

NS = 1_000_000_000
SLIP = 0.03
CERTAIN, VAGUE = np.eye(6) * 1e8, np.eye(6) * 1e-4  # information and covariance
LEFT, RIGHT, DISTANCE = 1.012, 1.004, 0.4  # what the wheels count per true way; between them [m]


def motions(forward, turn, parts=1000):
    """Return a true motion (x, y, yaw) at even speeds, and that of the wheels."""
    true, counted = np.eye(4), np.eye(4)
    half = turn * DISTANCE / 2.0
    left, right = (forward - half) * LEFT, (forward + half) * RIGHT
    for pose, ahead, round_ in (
        (true, forward, turn),
        (counted, (left + right) / 2.0, (right - left) / DISTANCE),
    ):
        angle = round_ / parts
        step = planar(ahead / parts * np.cos(angle / 2), ahead / parts * np.sin(angle / 2), angle)
        pose[:] = np.linalg.matrix_power(step, parts)
    return true, counted


DRIVE = [(0.8, 0.0), (0.8, 0.5), (0.0, -0.6), (0.5, -0.4), (-0.3, 0.2), (0.9, 0.0)] * 10


def learn(errors, counted, true, information=CERTAIN, expected=VAGUE):
    """Learn from a motion that a match shows with an information, beside what was expected."""
    change = change_between(errors.corrected(counted), true)
    drawn = np.linalg.solve(information + np.linalg.inv(expected), information @ change)
    errors.add(counted, drawn, information, VAGUE, expected)


@pytest.fixture(params=[VAGUE, VAGUE / 100.0], ids=['vague', 'sure'])
def learned(request):
    """Matches are drawn towards where the robot is expected; what they show is the same."""
    errors = OdometryErrors(SLIP)
    for drive in DRIVE:
        true, counted = motions(*drive)
        learn(errors, counted, true, np.eye(6) * 1e4, request.param)
    return errors


@pytest.mark.parametrize('drive', [(0.9, 0.0), (0.4, 0.6), (0.0, 1.0), (-0.5, -0.2)])
def test_a_motion_is_corrected_to_what_it_was(learned, drive):
    true, counted = motions(*drive)
    found = learned.corrected(counted)
    off, turned = np.linalg.norm((found - true)[:2, 3]), yaw_of(inverse(true) @ found)
    before = np.linalg.norm((counted - true)[:2, 3]), yaw_of(inverse(true) @ counted)
    assert off < 0.2 * before[0] + 1e-3
    assert abs(turned) < 0.1 * abs(before[1]) + 2e-4


def test_a_robot_that_drives_to_its_side_learns_how_it_turns():
    errors, counted = OdometryErrors(SLIP), planar(0.0, 0.5, 0.0)
    true = planar(-0.0025, 0.5, 0.01)  # an arc to the left
    for _ in range(200):
        learn(errors, counted, true)
    np.testing.assert_allclose(errors.corrected(counted), true, atol=2e-4)


def test_what_no_match_shows_is_not_learned():
    errors = OdometryErrors(SLIP)
    for drive in DRIVE:
        true, counted = motions(*drive)
        learn(errors, counted, true, np.zeros((6, 6)))
    np.testing.assert_array_equal(errors.estimate, np.zeros(4))
    np.testing.assert_allclose(errors.covariance, OdometryErrors(SLIP).covariance)


def test_a_turn_of_more_than_half_a_circle_is_no_error():
    errors = OdometryErrors(SLIP)
    learn(errors, planar(0.0, 0.0, 3.1), planar(0.0, 0.0, 3.2))
    assert 0.0 < errors.estimate[1] < 0.1


def test_a_robot_that_rocks_keeps_the_height_and_the_tilt_of_odometry():
    """Turns are counted too far about the vertical, by wheels or by a levelled gyroscope."""
    track, true, odometry = Track(MapConfig()), np.eye(4), np.eye(4)
    track.move_to(true, 0, odometry)
    for k in range(1, 100):
        level, counted = motions(0.3, 0.4)
        true, odometry = true @ level, odometry @ counted
        tilt = np.eye(4)
        tilt[:3, :3] = Rotation.from_rotvec(
            [0.1 * np.sin(k), 0.1 * np.cos(2.0 * k), 0.0]
        ).as_matrix()
        found = track.predicted(k * NS, odometry @ tilt)
        np.testing.assert_allclose(found[2], (odometry @ tilt)[2], atol=1e-5)
        found = true @ tilt
        track.learn(found, CERTAIN)
        track.move_to(found, k * NS, odometry @ tilt)


def test_deskewed_points_lose_the_learned_errors_of_odometry():
    """Points of one sweep on a drive along a curve, deskewed by the wheels."""
    track = Track(MapConfig())
    pose = odometry = np.eye(4)
    track.move_to(pose, 0, odometry)
    for k in range(1, 50):
        true, counted = motions(0.8, 0.3)
        pose, odometry = pose @ true, odometry @ counted
        track.predicted(k * NS, odometry)
        track.learn(pose, CERTAIN)
        track.move_to(pose, k * NS, odometry)
    true, counted = motions(0.8, 0.3)
    track.predicted(50 * NS, odometry @ counted)
    age = np.linspace(1.0, 0.0, 20)
    wall = np.random.default_rng(1).uniform(-4.0, 4.0, (20, 3))  # as the robot sees it at last
    deskewed, lidars = [], []
    for point, a in zip(wall, age, strict=True):
        true_rest, counted_rest = motions(0.8 * a, 0.3 * a)
        lidars.append(moved(inverse(true_rest), np.array([[0.1, 0.0, 0.0]]))[0])
        deskewed.append(moved(inverse(counted_rest) @ true_rest, point[None])[0])
    deskewed = np.array(deskewed)
    off = np.linalg.norm(deskewed - wall, axis=1)
    lidar = np.array([0.1, 0.0, 0.0])
    seen = track.seen(deskewed, age, lidar)
    left = np.linalg.norm(seen.points - wall, axis=1)
    assert off.max() > 0.02
    assert left.max() < 0.1 * off.max()
    np.testing.assert_allclose(seen.origins, lidars, atol=0.03)


@pytest.mark.parametrize('share', [0.0, 0.5, 1.0])
def test_what_was_learned_is_forgotten_by_a_share(learned, share):
    """A match that shows nothing, where the robot stands."""
    unknown = np.linalg.inv(OdometryErrors(SLIP).covariance)
    pull = np.linalg.solve(learned.covariance, learned.estimate)
    known = np.linalg.inv(learned.covariance) - unknown
    nothing = np.zeros((6, 6))
    learned.add(np.eye(4), np.zeros(6), nothing, VAGUE, VAGUE, prior_weight=1.0 - share)
    information = (1.0 - share) * known + unknown
    np.testing.assert_allclose(learned.covariance, np.linalg.inv(information), rtol=1e-6)
    expected = np.linalg.solve(information, (1.0 - share) * pull)
    np.testing.assert_allclose(learned.estimate, expected, atol=1e-9)


def test_who_forgets_all_learns_as_from_the_beginning(learned):
    """The match is the same; the expectations, and so the changes from them, are not."""
    true, counted = motions(0.5, 0.1)
    fresh = OdometryErrors(SLIP)
    for errors in (fresh, learned):
        change = change_between(errors.corrected(counted), true)
        drawn = np.linalg.solve(CERTAIN + np.linalg.inv(VAGUE), CERTAIN @ change)
        errors.add(counted, drawn, CERTAIN, VAGUE, VAGUE, prior_weight=0.0)
    np.testing.assert_allclose(learned.covariance, fresh.covariance)
    np.testing.assert_allclose(learned.estimate, fresh.estimate, atol=2e-4)
