"""Recorded messages as the input of a calibration."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_source import BagSource
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.read_bag import LogGatherer, with_odometry
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.calibration.beam_model import CalibrationError, Values
from nodlidar_assembler.config import AssemblerConfig
import numpy as np

# How far odometry of a robot that stands may drift [m], [rad].
STANDS, FACES = 0.03, 0.02


class Recorder(LogGatherer):
    """Gathers scans and joint states, whose offset, delay and zero are left as they are.

    Parameters
    ----------
    config
        Parameters of the assembler.
    """

    def __init__(self, config: AssemblerConfig) -> None:
        super().__init__(replace(config, joint_delay=0.0, joint_zero=0.0, range_offset=0.0))

    def log(self) -> SensorLog:
        """Return what was gathered; raises CalibrationError if too little can be used."""
        refused = ', '.join(f'{count} {reason}' for reason, count in self.drops.items())
        if not self.scans:
            raise CalibrationError(f'no usable scan: {refused}' if refused else 'no scan came')
        log = super().log()
        if len(log.sample_ns) < 2:
            why = self.joint.missing_input or refused
            raise CalibrationError('too few joint states' + (f': {why}' if why else ''))
        return log


def log_of_bag(path: Path, config: AssemblerConfig, topics: Topics) -> SensorLog:
    """Return the log of a bag's topics, with odometry if the bag has it.

    Raises
    ------
    BagError
        If the bag cannot be read, or lacks a topic.
    CalibrationError
        If it has no scans or joint states.
    """
    with BagSource(path) as source:
        log = Recorder(config).read(source, source.inputs(topics))
    try:
        return with_odometry(log, path, config, topics)
    except BagError as error:
        text = f'that the robot stands was not checked: {error}'
        return replace(log, damage=[*log.damage, text])


def require_standing(log: SensorLog) -> None:
    """Raise CalibrationError if the robot moves, by its odometry; without, nobody knows."""
    if log.odometry is None:
        return
    poses = log.odometry.poses
    way = np.linalg.norm(poses.position - poses.position[0], axis=1).max()
    turn = 2.0 * np.arccos(np.abs(poses.orientation @ poses.orientation[0]).clip(max=1.0)).max()
    if way > STANDS or turn > FACES:
        raise CalibrationError(
            f'the robot moves in this recording, by {way:.2g} m and {turn:.2g} rad: '
            'record it where it stands'
        )


def start_values(config: AssemblerConfig) -> Values:
    """Return the values that the parameters set."""
    axis = config.joint_axis
    values = Values.of_laser(config, config.joint_delay, axis.sign * axis.zero)
    return replace(values, offset=config.range_offset)


def parameters(values: Values, config: AssemblerConfig) -> dict[str, Any]:
    """Return the parameters of the assembler for some values."""
    return {
        'joint_delay': values.delay,
        'joint_zero': config.joint_axis.sign * values.zero,
        'laser_xyz': [values.x, values.y, values.z],
        'laser_rpy': [values.roll, values.pitch, values.yaw],
        'beam_elevation': values.elevation,
        'range_offset': values.offset,
    }
