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
    margin_ns
        How long before and after a scan joint states are wanted beyond those that bracket it [ns].
        A scan waits for them, too, but at the deadline, or with a short history, does without.
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
        margin_ns: int = 0,
    ) -> None:
        super().__init__()
        self._history = history
        self._duration_ns = duration_ns
        self._deadline_ns = round(deadline * NS_PER_S)
        self._now_ns = now_ns
        self._on_drop = on_drop
        self._margin_ns = margin_ns
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
        end_ns = start_ns + self._duration_ns(scan)
        last = self._after(end_ns + self._margin_ns)
        if last is None and self._now_ns() - arrival_ns <= self._deadline_ns:
            return False
        last, first = last or self._after(end_ns), self._before(start_ns)
        if last is None:
            self._on_drop(scan, self.LATE)
        elif first is None:
            self._on_drop(scan, self.NO_HISTORY)
        else:
            first = self._before(start_ns - self._margin_ns) or first
            self.signalMessage(scan, self._states(start_ns, end_ns, first, last))
        return True

    def _states(self, start_ns: int, end_ns: int, first: Time, last: Time) -> list[JointState]:
        """Return the joint states from one to another, and those within the margin."""
        first = min(first, _time(start_ns - self._margin_ns))
        last = max(last, _time(end_ns + self._margin_ns))
        return list(self._history.getInterval(first, last))

    def _before(self, nanoseconds: int) -> Time | None:
        state = self._history.getElemBeforeTime(_time(nanoseconds))
        return None if state is None else Time.from_msg(state.header.stamp)

    def _after(self, nanoseconds: int) -> Time | None:
        state = self._history.getElemAfterTime(_time(nanoseconds))
        return None if state is None else Time.from_msg(state.header.stamp)


def _time(nanoseconds: int) -> Time:
    """Return a time; what lies before 0, as a margin may there, is 0."""
    return Time(nanoseconds=max(nanoseconds, 0), clock_type=ClockType.ROS_TIME)
