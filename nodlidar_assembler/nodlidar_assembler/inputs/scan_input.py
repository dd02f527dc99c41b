"""LaserScan messages as scans, those from which points can be made."""

import math
from typing import Any

from nodlidar_assembler.clouds.geometry import revolution_time
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.scan_watch import ScanWatch
from nodlidar_assembler.inputs.scan_message import scan_from_message
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.nod import NS_PER_S


class RefusedScanError(NodlidarError):
    """A scan from which no points can be made; reasons are counted, so no value is in them."""


class ScanInput:
    """Takes scans as the parameters say, and refuses those that are malformed or mistimed.

    Parameters
    ----------
    config
        Tells how their times are to be taken, and how far they see.

    Attributes
    ----------
    watch
        Knows the lidar's revolutions, and how many scans are missing.
    """

    def __init__(self, config: AssemblerConfig) -> None:
        self.watch = ScanWatch()
        self._delay_ns = round(config.scan_delay * NS_PER_S)
        self._time_increment = config.time_increment
        self._max_range = config.max_range or math.inf

    def scan(self, message: Any) -> Scan:
        """Return a LaserScan as a scan; raises RefusedScanError."""
        try:
            scan = scan_from_message(
                message, self._delay_ns, self._time_increment, self._max_range
            )
            nominal = revolution_time(scan.geometry)
        except ParameterError as error:
            raise RefusedScanError(f'{error.key} must be {error.limit}') from error
        if reason := self.watch.refuse(scan.stamp_ns, nominal):
            raise RefusedScanError(reason)
        return scan
