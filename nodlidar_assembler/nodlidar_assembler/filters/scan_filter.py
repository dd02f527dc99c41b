"""Passes on the scans from which points can be made."""

from collections.abc import Callable
import math

from message_filters import SimpleFilter
from nodlidar_assembler.clouds.geometry import revolution_time
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.scan_watch import ScanWatch
from nodlidar_assembler.filters.scan_message import geometry_from_message
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import LATEST_NS, time_ns
from sensor_msgs.msg import LaserScan


class ScanFilter(SimpleFilter):
    """Passes on well-formed scans; gives the reason to `on_drop` for each of the others.

    Parameters
    ----------
    source
        Of the scans.
    config
        Tells how their times are to be taken, and how far they see; scans are changed accordingly.
    on_drop
        Called with the reason when one is dropped.

    Attributes
    ----------
    watch
        Knows the lidar's revolutions, and how many scans are missing.
    """

    def __init__(
        self, source: SimpleFilter, config: AssemblerConfig, on_drop: Callable[[str], None]
    ) -> None:
        super().__init__()
        self.watch = ScanWatch()
        self._delay_ns = round(config.scan_delay * NS_PER_S)
        self._time_increment = config.time_increment
        self._max_range = config.max_range or math.inf
        self._on_drop = on_drop
        source.registerCallback(self._add)

    def _add(self, scan: LaserScan) -> None:
        try:
            self._take_times(scan)
            scan.range_max = min(scan.range_max, self._max_range)
            nominal = revolution_time(geometry_from_message(scan))
        except ParameterError as error:
            # Without the value: reasons are counted, and must not be as many as there are values.
            self._on_drop(f'{error.key} must be {error.limit}')
            return
        reason = self.watch.refuse(time_ns(scan.header.stamp), nominal)
        if reason:
            self._on_drop(reason)
        else:
            self.signalMessage(scan)

    def _take_times(self, scan: LaserScan) -> None:
        first_ns = time_ns(scan.header.stamp) - self._delay_ns
        if not 0 <= first_ns <= LATEST_NS:
            raise ParameterError('stamp', 'after 1970 and before 2038', first_ns / NS_PER_S)
        scan.header.stamp.sec, scan.header.stamp.nanosec = divmod(first_ns, NS_PER_S)
        if scan.time_increment == 0.0:
            scan.time_increment = self._time_increment
