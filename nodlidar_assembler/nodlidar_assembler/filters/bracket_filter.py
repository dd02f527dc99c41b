"""Releases each scan together with the joint samples that bracket its first to its last beam."""

from collections.abc import Callable

from message_filters import SimpleFilter
from nodlidar_assembler.clouds.joint_history import JointHistory
from nodlidar_assembler.filters.waiting_filter import WaitingFilter
from nodlidar_common.stamps import time_ns
from sensor_msgs.msg import LaserScan


class BracketFilter(WaitingFilter):
    """A message_filters filter: scan in, (scan, the JointSamples that bracket it) out.

    One that cannot be bracketed is given to `on_drop` with the reason: the history begins after
    its first beam, or no later joint state came before the deadline.

    Parameters
    ----------
    scan_filter
        Filter whose messages are LaserScans.
    joint_filter
        Filter whose messages are the stamps [ns] and positions [rad] of joint samples, in the
        order of their time: an older one begins another time.
    duration_ns, deadline, now_ns
        As of WaitingFilter.
    on_drop
        Called with a scan that is dropped and the reason.
    margin_ns
        How long before and after a scan joint samples are wanted beyond those that bracket it
        [ns]. A scan waits for them, too, but at the deadline, or with a short history, does
        without.
    """

    TIME_WENT_BACK = 'joint states went back in time'
    NO_HISTORY = 'no joint state before it'
    LATE = 'no joint state after it before the deadline'

    def __init__(
        self,
        scan_filter: SimpleFilter,
        joint_filter: SimpleFilter,
        duration_ns: Callable[[LaserScan], int],
        deadline: float,
        now_ns: Callable[[], int],
        on_drop: Callable[[LaserScan, str], None],
        margin_ns: int = 0,
    ) -> None:
        super().__init__(scan_filter, duration_ns, deadline, now_ns)
        self._history = JointHistory()
        self._on_drop = on_drop
        self._margin_ns = margin_ns
        joint_filter.registerCallback(self._add_sample)

    def _add_sample(self, stamp_ns: int, pitch: float) -> None:
        """Go on with the scans that wait; forget the history when time went back."""
        newest_ns = self._history.newest_ns
        if newest_ns is not None and newest_ns > stamp_ns:
            self.forget(self.TIME_WENT_BACK)
        self._history.add(stamp_ns, pitch)
        self.release()

    def forget(self, reason: str) -> None:
        """Forget the history, and drop what waits for a reason."""
        self._history.clear()
        self._drain(self._on_drop, reason)

    def _settled(self, overdue: bool, scan: LaserScan, *given: None) -> bool:
        start_ns = time_ns(scan.header.stamp)
        end_ns = start_ns + self._duration_ns(scan)
        history, margin_ns = self._history, self._margin_ns
        last = history.after(end_ns + margin_ns)
        if last is None and not overdue:
            return False
        if history.after(end_ns) is None:
            self._on_drop(scan, self.LATE)
        elif history.before(start_ns) is None:
            self._on_drop(scan, self.NO_HISTORY)
        else:
            first = history.before(start_ns - margin_ns)
            begin_ns = start_ns - margin_ns if first is None else first
            until_ns = end_ns + margin_ns if last is None else last
            self.signalMessage(scan, history.between(begin_ns, until_ns))
        return True
