"""Releases each scan together with the joint states that bracket its first to its last beam."""

from collections import deque
from collections.abc import Callable

from message_filters import Cache, SimpleFilter
from nodlidar_assembler.turns import TIME_JUMP_NS
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import time_ns
from rclpy.clock import ClockType
from rclpy.time import Time
from sensor_msgs.msg import JointState, LaserScan


class BracketFilter(SimpleFilter):
    """A message_filters filter: scan in, (scan, the joint states that bracket it) out.

    Scans leave in the order in which they came. One that cannot be bracketed is given to `on_drop`
    with the reason: the history begins after its first beam, or no later joint state came before
    the deadline.

    Parameters
    ----------
    scan_filter
        Filter whose messages are LaserScans.
    history
        Cache of joint states.
    duration_ns
        Tells the time from a scan's first to its last beam [ns].
    deadline
        Longest time that a scan waits [s].
    now_ns
        The clock by which it waits [ns].
    on_drop
        Called with a scan that is dropped and the reason.
    """

    TIME_WENT_BACK = 'joint states went back in time'
    NO_HISTORY = 'no joint state before it'
    LATE = 'no joint state after it before the deadline'

    def __init__(
        self,
        scan_filter: SimpleFilter,
        history: Cache,
        duration_ns: Callable[[LaserScan], int],
        deadline: float,
        now_ns: Callable[[], int],
        on_drop: Callable[[LaserScan, str], None],
    ) -> None:
        super().__init__()
        self._history = history
        self._duration_ns = duration_ns
        self._deadline_ns = round(deadline * NS_PER_S)
        self._now_ns = now_ns
        self._on_drop = on_drop
        self._waiting: deque[tuple[int, LaserScan]] = deque()
        scan_filter.registerCallback(self._add_scan)
        self._newest_ns = 0
        history.registerCallback(self._state_added)

    def release(self) -> None:
        """Release or drop every scan that can be by now; for the deadline, call it by a timer."""
        while self._waiting and self._settled(*self._waiting[0]):
            self._waiting.popleft()

    def _state_added(self, state: JointState) -> None:
        """Go on with the scans that wait; forget the history when time went back."""
        stamp_ns = time_ns(state.header.stamp)
        if self._newest_ns - stamp_ns > TIME_JUMP_NS:
            del self._history.cache_msgs[:-1], self._history.cache_times[:-1]
            while self._waiting:
                self._on_drop(self._waiting.popleft()[1], self.TIME_WENT_BACK)
            self._newest_ns = stamp_ns
        self._newest_ns = max(self._newest_ns, stamp_ns)
        self.release()

    def _add_scan(self, scan: LaserScan) -> None:
        self._waiting.append((self._now_ns(), scan))
        self.release()

    def _settled(self, arrival_ns: int, scan: LaserScan) -> bool:
        start_ns = time_ns(scan.header.stamp)
        end = _time(start_ns + self._duration_ns(scan))
        after = self._history.getElemAfterTime(end)
        if after is None:
            if self._now_ns() - arrival_ns <= self._deadline_ns:
                return False
            self._on_drop(scan, self.LATE)
            return True
        before = self._history.getElemBeforeTime(_time(start_ns))
        if before is None:
            self._on_drop(scan, self.NO_HISTORY)
            return True
        first, last = Time.from_msg(before.header.stamp), Time.from_msg(after.header.stamp)
        self.signalMessage(scan, self._history.getInterval(first, last))
        return True


def _time(nanoseconds: int) -> Time:
    return Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
