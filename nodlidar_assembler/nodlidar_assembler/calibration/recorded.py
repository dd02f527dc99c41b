"""Recorded messages as the input of a calibration."""

from collections import Counter
from contextlib import suppress
from dataclasses import replace
import math
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.bags.bag_types import BagError, JOINT_STATE, SCAN
from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.calibration.beam_model import CalibrationError, Values
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.pitch import ordered_samples
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
import numpy as np


class Recorder:
    """Gathers scans and joint states, whose delay and zero are left as they are.

    Parameters
    ----------
    config
        Parameters of the assembler.
    """

    def __init__(self, config: AssemblerConfig) -> None:
        self._scan_input = ScanInput(config)
        raw = replace(config, joint_delay=0.0, joint_zero=0.0)
        self._joint = JointInput(raw, Counter())
        self._scans: list[Scan] = []
        self._samples: list[tuple[int, float]] = []

    def add_scan(self, message: Any, arrived_ns: int) -> None:
        """Add a LaserScan that arrived at an instant [ns]; a malformed one is left out."""
        with suppress(RefusedScanError):
            self._scans.append(self._scan_input.scan(message, arrived_ns))

    def add_joint_state(self, message: Any) -> None:
        """Add a JointState."""
        self._samples += self._joint.samples(message)

    def log(self) -> SensorLog:
        """Return what was gathered; raises CalibrationError if either is missing."""
        if not self._scans:
            raise CalibrationError('no scan was received')
        if len(self._samples) < 2:
            raise CalibrationError(self._joint.missing_input or 'too few joint states')
        stamps, pitch = zip(*self._samples, strict=True)
        samples = ordered_samples(np.array(stamps, dtype=np.int64), np.array(pitch))
        return SensorLog(sorted(self._scans, key=lambda scan: scan.stamp_ns), *samples)


def log_of_bag(path: Path, config: AssemblerConfig, scan: str, joint_states: str) -> SensorLog:
    """Return the log of a bag's topics.

    Raises
    ------
    BagError
        If the bag cannot be read.
    CalibrationError
        If it has no scans or joint states.
    """
    recorder, wanted = Recorder(config), {(scan, SCAN), (joint_states, JOINT_STATE)}
    if not path.exists():
        raise BagError(f"'{path}' does not exist")
    for recorded in messages_of(path, lambda topic, kind: (topic, kind) in wanted):
        if recorded.msgtype == SCAN:
            recorder.add_scan(recorded.message, recorded.time_ns)
        else:
            recorder.add_joint_state(recorded.message)
    return recorder.log()


def start_values(config: AssemblerConfig) -> Values:
    """Return the values that the parameters set."""
    return Values.of_mount(config, config.joint_delay, _sign(config) * config.joint_zero)


def parameters(values: Values, config: AssemblerConfig) -> dict[str, Any]:
    """Return the parameters of the assembler for some values."""
    return {
        'joint_delay': values.delay,
        'joint_zero': _sign(config) * values.zero,
        'laser_xyz': [values.x, values.y, values.z],
        'laser_rpy': [values.roll, values.pitch, values.yaw],
    }


def _sign(config: AssemblerConfig) -> float:
    return 1.0 if config.joint_positive == 'up' else -1.0


def upward(mount_rpy: tuple[float, float, float]) -> 'np.ndarray[Any, np.dtype[np.float64]]':
    """Return upward in a frame with this roll, pitch and yaw [rad], shape (3,)."""
    roll, pitch, _ = mount_rpy
    return np.array(
        [
            -math.sin(pitch),
            math.cos(pitch) * math.sin(roll),
            math.cos(pitch) * math.cos(roll),
        ]
    )
