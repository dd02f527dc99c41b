"""A robot that drives and turns sees surfaces as sharply as one that stands."""

from dataclasses import replace

from nodlidar_assembler.bags.sensor_log import assemble_log
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, Poses
from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_common.nod import Nod
from nodlidar_demo.evaluation import moved_surface_rms, near_beams, points_of_log
from nodlidar_demo.simulated_log import simulated_log, simulated_odometry
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000


def drive(speed, turn_rate, start=(0.0, 0.0, 0.0), duration=12.0, scene='room'):
    moving = load_scene(scene, ideal=True).with_velocity((speed, turn_rate))
    scene = replace(moving, base_start=start)
    nod = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, START_NS)
    return simulate(scene, nod, duration, start_ns=START_NS)


@pytest.fixture(scope='module')
def driving():
    return drive(0.4, 0.5)


def beam_rms(simulated, odometry):
    log = replace(near_beams(simulated_log(simulated)), odometry=odometry)
    points = points_of_log(log, 'slerp')
    return moved_surface_rms(points.xyz, points.time_ns, simulated.world)


def test_a_driving_robot_is_at_most_1_2_times_as_inexact_as_a_standing_one(driving):
    standing = drive(0.0, 0.0)
    rms_standing = beam_rms(standing, simulated_odometry(standing))
    assert beam_rms(driving, simulated_odometry(driving)) <= 1.2 * rms_standing


def test_one_pose_per_scan_is_at_least_3_times_worse(driving):
    odometry = simulated_odometry(driving)
    middle_ns = driving.true_time_ns[:, 341]
    points = points_of_log(near_beams(simulated_log(driving)), 'slerp')
    scan = np.searchsorted(driving.scan_stamp_ns, points.time_ns, side='right') - 1
    xyz = odometry.at(middle_ns, OdometryConfig())[scan].to_parent(points.xyz)
    rms = moved_surface_rms(xyz, points.time_ns, driving.world)
    assert rms >= 3.0 * beam_rms(driving, odometry)


def test_odometry_begins_where_the_robot_does():
    simulated = drive(0.3, -0.4, start=(0.5, -0.4, 1.1), duration=4.0)
    assert beam_rms(simulated, simulated_odometry(simulated)) < 0.005


def test_people_are_no_error_of_a_robot_that_passes_them():
    simulated = drive(0.2, 0.1, start=(-0.3, 0.2, -0.1), duration=4.0, scene='crossing')
    assert beam_rms(simulated, simulated_odometry(simulated)) < 0.005


def test_scans_that_odometry_does_not_cover_are_dropped_by_reason(driving):
    whole = simulated_odometry(driving)
    stamps = whole.time_ns - START_NS
    kept = (stamps > 1e9) & (stamps < 8e9) & ~((stamps > 3e9) & (stamps < 3.5e9))
    position = whole.poses.position[kept].copy()
    position[stamps[kept] > 5_030_000_000] += (0.5, 0.0, 0.0)  # a jump in 20 ms, within a scan
    part = Odometry(whole.time_ns[kept], Poses(position, whole.poses.orientation[kept]))
    log = replace(simulated_log(driving), odometry=part)
    clouds, drops = assemble_log(log, PipelineConfig())
    assert sum(drops.values()) + len(clouds) == len(log.scans)
    stamp = (driving.scan_stamp_ns - START_NS) / 1e9
    end = (driving.true_time_ns[:, -1] - START_NS) / 1e9
    early = stamp < stamps[kept][0] / 1e9
    expected = {
        'no odometry before the first beam': np.sum(early),
        'no odometry after the last beam': np.sum(end > stamps[kept][-1] / 1e9),
        'odometry more than 0.2 s apart': np.sum((end > 3.0) & (stamp < 3.5)),
        'odometry jumps: it moves faster than 5.0 m/s': np.sum((end > 5.02) & (stamp < 5.04)),
    }
    assert drops == expected
