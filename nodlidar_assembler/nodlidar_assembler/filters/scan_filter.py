"""Passes on the scans from which points can be made."""

from collections.abc import Callable

from message_filters import SimpleFilter
from nodlidar_assembler.filters.scan_message import geometry_from_message
from nodlidar_common.errors import ParameterError
from sensor_msgs.msg import LaserScan


class ScanFilter(SimpleFilter):
    """Passes on well-formed scans, and gives the reason to `on_drop` for each of the others."""

    def __init__(self, source: SimpleFilter, on_drop: Callable[[str], None]) -> None:
        super().__init__()
        self._on_drop = on_drop
        source.registerCallback(self._add)

    def _add(self, scan: LaserScan) -> None:
        try:
            _check(scan)
        except ParameterError as error:
            # Without the value: reasons are counted, and must not be as many as there are values.
            self._on_drop(f'{error.key} must be {error.limit}')
        else:
            self.signalMessage(scan)


def _check(scan: LaserScan) -> None:
    if scan.header.stamp.sec < 0:
        raise ParameterError('stamp', 'after 1970', scan.header.stamp.sec)
    geometry_from_message(scan)
