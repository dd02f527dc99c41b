"""Scans of the simulator in, limits and coverage out: as the node does it, in virtual time."""

from dataclasses import replace
import math

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ego_motion import Poses
from nodlidar_assembler.geometry import Beams, REFERENCE_MOUNT, ScanGeometry
from nodlidar_assembler.nod_adaptation import BAND
from nodlidar_assembler.pipeline import Scan
from nodlidar_assembler.pitch_limits import limits_at, PitchLimitsConfig
from nodlidar_assembler.surroundings import Surroundings
from nodlidar_common.nod import NodTrajectory
from nodlidar_sim.scene import load_scene
from nodlidar_sim.simulation import simulate
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000
BEAM = 0.1 / 1024
# 681 of the 682 beams are within the region, which is as wide to both sides.
GEOMETRY = ScanGeometry(682, (44 - 384) * math.tau / 1024, math.tau / 1024, BEAM, 0.02, 5.6)
BEAMS = Beams(GEOMETRY, REFERENCE_MOUNT)


def told(duration, start_ns=START_NS, **changes):
    nod = NodTrajectory(-0.4, 0.4, 4001 * BEAM, 4001, START_NS)
    recording = simulate(replace(load_scene('wall'), **changes), nod, duration, start_ns=start_ns)
    return [
        (Scan(int(stamp), GEOMETRY, ranges.astype(np.float32)), pitch)
        for stamp, ranges, pitch in zip(
            recording.scan_stamp_ns, recording.ranges, recording.true_pitch, strict=True
        )
    ]


def poses_at(x):
    turned_left = np.array([0.0, 0.0, math.sin(0.5), math.cos(0.5)])
    ahead = np.array([math.cos(1.0), math.sin(1.0), 0.0])
    return Poses(np.tile(x * ahead, (682, 1)), np.tile(turned_left, (682, 1)))


def add(surroundings, scan, pitch, poses=None):
    surroundings.add_scan(scan, BEAMS, pitch)
    surroundings.follow(scan, BEAMS, pitch, poses)


def test_a_wall_gives_the_limits_of_its_median_range():
    surroundings = Surroundings(AssemblerConfig())
    assert surroundings.shape() is None
    for scan, pitch in told(3.0):
        add(surroundings, scan, pitch)
        shape = surroundings.shape()
    expected = limits_at(PitchLimitsConfig(), 2.0 / math.cos(math.radians(15.0)))
    assert (shape.pitch_min, shape.pitch_max) == pytest.approx(expected, abs=0.02)
    assert 4001 / BAND <= shape.samples_per_sweep <= 4001 * BAND
    covered = surroundings.covered()
    assert covered.beams == 30 * 681
    # The nod keeps off the outer third of the region.
    assert 0.5 < covered.seen < 2.0 / 3.0 + 0.05


def test_odometry_in_any_direction_of_the_odom_frame_predicts_the_range():
    scans = told(3.0, base_start=(-1.5, 0.0, 0.0), base_velocity=(0.5, 0.0))
    limits = []
    for odometry in (True, False):
        surroundings = Surroundings(AssemblerConfig())
        for k, (scan, pitch) in enumerate(scans):
            add(surroundings, scan, pitch, poses_at(0.05 * k) if odometry else None)
            shape = surroundings.shape()
        limits.append(shape.pitch_max)
    expected = limits_at(PitchLimitsConfig(), (3.5 - 1.45) / math.cos(math.radians(15.0)))[1]
    assert limits[0] == pytest.approx(expected, rel=0.06)
    assert limits[1] < 0.9 * expected


def test_when_time_goes_back_everything_starts_anew():
    surroundings = Surroundings(AssemblerConfig())
    for scan, pitch in told(2.0) + told(1.0):
        add(surroundings, scan, pitch)
        assert surroundings.shape() is not None
    assert surroundings.covered().beams == 10 * 681


def test_a_scan_that_begins_just_before_the_last_ones_end_is_kept():
    surroundings = Surroundings(AssemblerConfig())
    [(scan, pitch)] = told(0.1)
    add(surroundings, scan, pitch)
    closely = replace(scan, stamp_ns=scan.stamp_ns + BEAMS.duration_ns - 1000)
    add(surroundings, closely, pitch)
    assert surroundings.covered().beams == 2 * 681


def test_a_lidar_that_thins_its_beams_does_not_make_the_nod_faster():
    """N_s counts steps, however few of them are beams."""
    [(scan, pitch)] = told(0.1)
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
        surroundings = Surroundings(AssemblerConfig(max_nod_speed=0.5))
        surroundings.add_scan(thinned, Beams(geometry, REFERENCE_MOUNT), pitch[::thinning])
        shapes.append(surroundings.shape())
    assert shapes[0].samples_per_sweep > BAND * 4001
    assert shapes[1].samples_per_sweep == shapes[0].samples_per_sweep
