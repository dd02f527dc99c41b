"""Releases each scan with the odometry that brackets its beams, up to the newest."""

from collections.abc import Callable

from message_filters import SimpleFilter
from nodlidar_assembler.clouds.ego_motion import OdometryError
from nodlidar_assembler.clouds.joint_history import JointSamples
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.filters.waiting_filter import WaitingFilter
from nodlidar_common.stamps import time_ns
from sensor_msgs.msg import LaserScan


class OdometryFilter(WaitingFilter):
    """A message_filters filter: (scan, joint samples) in, (scan, joint samples, odometry) out.

    The odometry goes on to the newest sample, for what shall be told of the present. A scan
    without odometry is given to `on_missing`, with its joint samples and the reason.

    Parameters
    ----------
    bracket_filter
        Filter whose messages are a scan and the joint samples that bracket it.
    history
        Odometry as it comes in; call `release` after that, and `forget` when time went back.
    duration_ns, deadline, now_ns
        As of WaitingFilter; the deadline is for the odometry alone.
    on_missing
        Called with a scan, its joint samples and the reason why it has no odometry.
    """

    TIME_WENT_BACK = 'odometry went back in time'
    NO_HISTORY = 'no odometry before it'
    LATE = 'no odometry after it before the deadline'

    def __init__(
        self,
        bracket_filter: SimpleFilter,
        history: OdometryHistory,
        duration_ns: Callable[[LaserScan], int],
        deadline: float,
        now_ns: Callable[[], int],
        on_missing: Callable[[LaserScan, JointSamples, str], None],
    ) -> None:
        super().__init__(bracket_filter, duration_ns, deadline, now_ns)
        self._history = history
        self._on_missing = on_missing

    def forget(self, reason: str = TIME_WENT_BACK) -> None:
        """Let all scans go without odometry: that which comes is of another time."""
        self._drain(self._on_missing, reason)

    def _settled(self, overdue: bool, scan: LaserScan, *given: JointSamples) -> bool:
        (samples,) = given
        start_ns = time_ns(scan.header.stamp)
        end_ns = start_ns + self._duration_ns(scan)
        oldest_ns, newest_ns = self._history.oldest_ns, self._history.newest_ns
        if oldest_ns is None or newest_ns is None or newest_ns < end_ns:
            if not overdue:
                return False
            self._on_missing(scan, samples, self.LATE)
        elif oldest_ns > start_ns:
            self._on_missing(scan, samples, self.NO_HISTORY)
        else:
            self._signal(scan, samples, start_ns, newest_ns)
        return True

    def _signal(
        self, scan: LaserScan, samples: JointSamples, start_ns: int, newest_ns: int
    ) -> None:
        try:
            odometry = self._history.around(start_ns, newest_ns)
        except OdometryError as error:
            self._on_missing(scan, samples, error.reason)
        else:
            self.signalMessage(scan, samples, odometry)
