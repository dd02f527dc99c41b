"""Scans of the simulator in, limits out: as the node does it, in virtual time."""

from dataclasses import replace
import math

from assembling import assembled_of
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.adapted_shape import BAND
from nodlidar_assembler.control.adaptive_limits import AdaptiveLimits
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimitsConfig
from nodlidar_common.nod import Nod
from nodlidar_common.pose import Pose
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
BEAM = 0.1 / 1024
MS = 1_000_000
# All 682 beams are within the region, which is the window of the lidar.
GEOMETRY = ScanGeometry(682, (44 - 384) * math.tau / 1024, math.tau / 1024, BEAM, 0.02, 5.6)
BEAMS = Beams(GEOMETRY, REFERENCE_LASER_POSE)


def scans_of_a_wall(duration, start_ns=START_NS, **changes):
    nod = Nod(-0.4, 0.4, 4001 * BEAM, 4001, START_NS)
    recording = simulate(
        replace(load_scene('wall', ideal=True), **changes), nod, duration, start_ns=start_ns
    )
    return [
        (Scan(int(stamp), GEOMETRY, ranges.astype(np.float32)), pitch)
        for stamp, ranges, pitch in zip(
            recording.scan_stamp_ns, recording.ranges, recording.true_pitch, strict=True
        )
    ]


def odometry_of(x, until_ns):
    """Return 50 Hz of a robot at x(t) on its way, which is turned in the frame of odometry."""
    time_ns = np.arange(START_NS - 20 * MS, until_ns + 1, 20 * MS)
    turned_left = np.array([0.0, 0.0, math.sin(0.5), math.cos(0.5)])
    ahead = np.array([math.cos(1.0), math.sin(1.0), 0.0])
    position = np.outer(x((time_ns - START_NS) / 1e9), ahead)
    return Odometry(time_ns, Poses(position, np.tile(turned_left, (len(time_ns), 1))))


def add(adaptive, scan, pitch, odometry=None):
    adaptive.add(assembled_of(scan, BEAMS, pitch), odometry)


def test_a_wall_gives_the_limits_of_its_median_range():
    adaptive = AdaptiveLimits(AssemblerConfig(samples_per_sweep=4001))
    assert adaptive.shape() is None
    for scan, pitch in scans_of_a_wall(3.0):
        add(adaptive, scan, pitch)
        shape = adaptive.shape()
    expected = limits_at(PitchLimitsConfig(), 2.0 / math.cos(math.radians(15.0)))
    assert (shape.pitch_min, shape.pitch_max) == pytest.approx(expected, abs=0.02)
    assert 4001 / BAND <= shape.samples_per_sweep <= 4001 * BAND


def test_the_limits_of_a_tilted_sensor_follow_what_is_level():
    """A sensor that looks down by 0.2 rad has to nod higher by as much."""
    tilt = {'mount': Pose.from_xyzrpy((0.0, 0.0, 1.0, 0.0, 0.2, 0.0))}
    adaptive = AdaptiveLimits(AssemblerConfig(mount_tilt=(0.0, 0.2), pitch_max=0.8))
    for scan, pitch in scans_of_a_wall(3.0, **tilt):
        add(adaptive, scan, pitch)
        shape = adaptive.shape()
    wide = PitchLimitsConfig(pitch_min=-1.0, pitch_max=1.0)
    low, high = limits_at(wide, 2.0 / math.cos(math.radians(15.0)))
    expected = max(low + 0.2, -0.6136), min(high + 0.2, 0.8)
    assert (shape.pitch_min, shape.pitch_max) == pytest.approx(expected, abs=0.02)


SPEED, WALL, DELAY_NS = 0.5, 3.5, 120 * MS
DRIVE = {'base_start': (2.0 - WALL, 0.0, 0.0), 'base_velocity': (SPEED, 0.0)}


def lags(odometry_ns, x=lambda t: SPEED * t, known=lambda t: True):
    """Return how late limits are on the way to a wall [s], DELAY_NS after scans' first beams.

    They are compared with those of the distance then, the wall's 2 m ahead of where it begins;
    odometry is known up to odometry_ns from the scan's first beam, at the times at which it is.
    """
    adaptive, found = AdaptiveLimits(AssemblerConfig(limits_rate=20.0)), []
    for scan, pitch in scans_of_a_wall(3.8, **DRIVE):
        odometry = None
        if odometry_ns is not None and known((scan.stamp_ns - START_NS) / 1e9):
            odometry = odometry_of(x, scan.stamp_ns + odometry_ns)
        add(adaptive, scan, pitch, odometry)
        followed = 0.92 / math.tan(adaptive.shape().pitch_max)
        now = (scan.stamp_ns + DELAY_NS - START_NS) / 1e9
        found.append((followed * math.cos(math.radians(15.0)) - (WALL - SPEED * now)) / SPEED)
    return np.array(found[15:])


def test_limits_are_for_where_the_robot_is_by_the_newest_odometry():
    """They lag by what the hysteresis of 5 % holds back, which is 0.3 s at 3 m."""
    newest = lags(DELAY_NS)
    assert (newest > 0.0).all()
    assert (newest < 0.3).all()
    # What odometry does not tell yet is lag; without any, half of the window comes on top.
    assert np.mean(lags(80 * MS) - newest) == pytest.approx(0.04, abs=0.005)
    assert np.mean(lags(None) - newest) > 0.6


def test_a_jump_of_odometry_does_not_move_the_limits():
    """It is 3 m, between a scan and the next: the 0.1 s since the scan before are not counted."""
    jumping = lags(DELAY_NS, lambda t: SPEED * t + 3.0 * (t > 2.09))
    assert (jumping > 0.0).all()
    assert (jumping < 0.3 + 0.1).all()


def test_the_way_without_odometry_is_not_counted_when_it_comes_back():
    """What was seen on that way was seen from nearer already."""
    missing = lags(DELAY_NS, known=lambda t: not 1.0 < t < 2.5)
    assert (missing > 0.0).all()
    assert (missing < 0.3 + 0.8 + 0.1).all()  # half of the window, as without odometry


def test_when_time_goes_back_everything_starts_anew():
    adaptive, anew = (AdaptiveLimits(AssemblerConfig()) for _ in range(2))
    for scan, pitch in scans_of_a_wall(3.0):
        add(adaptive, scan, pitch)
        assert adaptive.shape() is not None
    for scan, pitch in scans_of_a_wall(1.0):
        add(adaptive, scan, pitch)
        add(anew, scan, pitch)
        assert adaptive.shape() == anew.shape()


def test_a_scan_that_comes_twice_or_too_late_changes_no_limits():
    """They neither start anew nor go back in time."""
    adaptive, once = (AdaptiveLimits(AssemblerConfig()) for _ in range(2))
    scans = scans_of_a_wall(2.0)
    for scan, pitch in scans:
        add(once, scan, pitch)
    for before, (scan, pitch) in zip([scans[0], *scans], scans, strict=False):
        add(adaptive, scan, pitch)
        add(adaptive, scan, pitch)
        add(adaptive, *before)
    assert adaptive.shape() == once.shape()


def test_after_a_restart_limits_are_the_configured_ones():
    adaptive, scans = AdaptiveLimits(AssemblerConfig()), scans_of_a_wall(2.0)
    for scan, pitch in scans[:-1]:
        add(adaptive, scan, pitch)
        shape = adaptive.shape()
    assert shape.pitch_max < 0.5
    adaptive.restart()
    add(adaptive, *scans[-1])
    shape = adaptive.shape()
    assert (shape.pitch_min, shape.pitch_max) == (-0.6136, 0.6136)


def test_a_lidar_that_thins_its_beams_does_not_make_the_nod_faster():
    """N_s counts steps, however few of them are beams."""
    [(scan, pitch)] = scans_of_a_wall(0.1)
    shapes = []
    for thinning in (1, 2):
        geometry = replace(
            GEOMETRY,
            beams=GEOMETRY.beams // thinning,
            angle_increment=GEOMETRY.angle_increment * thinning,
            time_increment=GEOMETRY.time_increment * thinning,
        )
        thinned = Scan(scan.stamp_ns, geometry, scan.ranges[::thinning])
        # At 0.5 rad/s the span takes more than the planned N_s.
        adaptive = AdaptiveLimits(AssemblerConfig(samples_per_sweep=4001, max_nod_speed=0.5))
        beams = Beams(geometry, REFERENCE_LASER_POSE)
        adaptive.add(assembled_of(thinned, beams, pitch[::thinning]), None)
        shapes.append(adaptive.shape())
    assert shapes[0].samples_per_sweep > BAND * 4001
    assert shapes[1].samples_per_sweep == shapes[0].samples_per_sweep
