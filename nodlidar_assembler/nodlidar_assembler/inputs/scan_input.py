"""LaserScan messages as checked scans."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from nodlidar_assembler.clouds.geometry import revolution_time, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.inputs.one_source import OneSource
from nodlidar_assembler.inputs.scan_clock import ScanClock
from nodlidar_assembler.inputs.scan_timing import ScanTiming
from nodlidar_common.errors import ParameterError, ScanError
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import LATEST_NS, NS_PER_S, time_ns
import numpy as np


@dataclass(frozen=True)
class ScanInputConfig:
    """Scan messages."""

    scan_delay: float = parameter(
        0.0,
        'Delay of scan stamps after the beam that is measured first',
        unit='s',
        minimum=-1.0,
        maximum=1.0,
    )
    scan_clock: str = parameter(
        'host',
        'Clock of the scan stamps: host, that of the joint states, or device, the own clock of a '
        'lidar that was never set. The fastest of the last 50 scans then counts as not delayed',
        choices=('host', 'device'),
    )
    time_increment: float = parameter(
        0.0,
        'Time between beams for scans that do not state it; with 0 all beams of such a scan share '
        'one instant',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    last_beam_first: bool = parameter(
        False,
        'The lidar measures the last beam of a message first, as with drivers that reverse the '
        'beams of lidars that turn clockwise (docs/lidars.md)',
    )
    max_range: float = parameter(
        0.0,
        'Ignore ranges beyond it; with 0 only the range_max of the scan applies',
        unit='m',
        minimum=0.0,
        maximum=1e6,
    )
    range_offset: float = parameter(
        0.0,
        'Added to each range, for a lidar that measures all of them too short, or, if negative, '
        'too long',
        unit='m',
        minimum=-0.5,
        maximum=0.5,
    )


# Nearest and farthest range of any lidar [m]. Many drivers send 0, or a huge number, where it saw
# nothing, and do not exclude that by range_min and range_max.
_NEAREST, _FARTHEST = 1e-3, 1e6

# All scans of a lidar have the same geometry.
_geometry = lru_cache(maxsize=16)(ScanGeometry)


def scan_from_message(message: Any, config: ScanInputConfig = ScanInputConfig()) -> Scan:
    """Return a LaserScan, of rclpy or a bag, as a scan that shares its arrays if it can.

    Raises
    ------
    ParameterError
        If the message's stamp, angles, times or range limits are invalid.
    """
    stamp_ns = time_ns(message.header.stamp) - round(config.scan_delay * NS_PER_S)
    if not 0 <= stamp_ns <= LATEST_NS:
        raise ParameterError('stamp', 'after 1970 and before 2038', stamp_ns / NS_PER_S)
    beams, angle, step = len(message.ranges), message.angle_min, message.angle_increment
    if config.last_beam_first:
        angle, step = angle + (beams - 1) * step, -step
    offset = config.range_offset
    geometry = _geometry(
        beams,
        angle,
        step,
        message.time_increment or config.time_increment,
        max(max(message.range_min, _NEAREST) + offset, _NEAREST),
        min(message.range_max + offset, config.max_range or _FARTHEST),
    )
    order = slice(None, None, -1 if config.last_beam_first else 1)
    ranges = np.frombuffer(message.ranges, dtype=np.float32)[order]
    return Scan(
        stamp_ns=stamp_ns,
        geometry=geometry,
        ranges=ranges + np.float32(offset) if offset else ranges,
        intensities=np.frombuffer(message.intensities, dtype=np.float32)[order],
    )


class RefusedScanError(ScanError):
    """A malformed or mistimed scan."""


class ScanInput:
    """Converts scans as configured, and refuses malformed and mistimed ones.

    Parameters
    ----------
    config
        Delay of the stamps, default time_increment, order of the beams, largest range, offset.

    Attributes
    ----------
    timing
        Follows the lidar's revolutions, and counts missing scans.
    """

    OTHER_FRAME = 'scan of another frame than those before'
    SAME_STAMP = 'scan with the stamp of the one before'
    LATE = 'scan more than 1 s later than others, or the clock of the lidar was set back'

    def __init__(self, config: ScanInputConfig) -> None:
        self._config = config
        self._lidars = OneSource()
        self._stamp_ns: int | None = None  # of the last scan
        self.timing = ScanTiming()
        self._device_clock = ScanClock() if config.scan_clock == 'device' else None

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock of the host was set by a step [ns]."""
        self.timing.shift(step_ns)
        if self._device_clock is not None:
            self._device_clock.shift(-step_ns)

    def scan(self, message: Any, arrived_ns: int) -> Scan:
        """Return a LaserScan that arrived at an instant [ns], or raise RefusedScanError."""
        try:
            scan = scan_from_message(message, self._config)
            nominal = revolution_time(scan.geometry)
        except ParameterError as error:
            raise RefusedScanError(f'{error.key} must be {error.limit}', error.value) from error
        if not self._lidars.admits(message.header.frame_id, arrived_ns):
            raise RefusedScanError(self.OTHER_FRAME, message.header.frame_id)
        if scan.stamp_ns == self._stamp_ns:
            raise RefusedScanError(self.SAME_STAMP)
        self._stamp_ns = scan.stamp_ns
        if self._device_clock is not None:
            if not self._device_clock.add(scan.end_ns, arrived_ns):
                raise RefusedScanError(self.LATE)
            scan = replace(scan, stamp_ns=scan.stamp_ns - self._device_clock.ahead_ns)
        if reason := self.timing.refuse(scan.stamp_ns, nominal, arrived_ns):
            raise RefusedScanError(reason)
        return scan
