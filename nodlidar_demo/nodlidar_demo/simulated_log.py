"""Simulated recordings as the logs of their devices, without the truth."""

from dataclasses import replace

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_sim.simulation import Recording
import numpy as np


def simulated_log(simulated: Recording) -> SensorLog:
    """Return what the simulated devices measured, without the truth."""
    sensor = simulated.sensor
    geometry = ScanGeometry(
        beams=len(simulated.azimuth),
        angle_min=float(simulated.azimuth[0]),
        angle_increment=sensor.angle_increment,
        time_increment=sensor.time_increment,
        range_min=sensor.range_min,
        range_max=sensor.range_max,
    )
    ranges = simulated.ranges.astype(np.float32)
    scans = [
        Scan(int(stamp_ns), geometry, scan_ranges)
        for stamp_ns, scan_ranges in zip(simulated.scan_stamp_ns, ranges, strict=True)
    ]
    return SensorLog(scans, simulated.joint_stamp_ns, simulated.joint_position)


def simulated_odometry(simulated: Recording) -> Odometry:
    """Return the odometry of nodlidar_base_link from the simulated wheels."""
    x, y, yaw = simulated.odometry_pose.T
    zero = np.zeros_like(x)
    orientation = np.stack([zero, zero, np.sin(yaw / 2.0), np.cos(yaw / 2.0)], axis=1)
    of_base = Odometry(
        simulated.odometry_stamp_ns, Poses(np.stack([x, y, zero], axis=1), orientation)
    )
    return of_base.mounted(simulated.world.scene.mount)


def simulated_drive(simulated: Recording) -> SensorLog:
    """Return the log of the simulated devices, with the odometry of the wheels."""
    return replace(simulated_log(simulated), odometry=simulated_odometry(simulated))
