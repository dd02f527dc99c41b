"""Releases each scan together with the joint samples that bracket its first to its last beam."""

from collections import deque
from collections.abc import Callable

from message_filters import SimpleFilter
from nodlidar_assembler.joint_history import JointHistory
from nodlidar_assembler.turns import TIME_JUMP_NS
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.stamps import time_ns
from sensor_msgs.msg import LaserScan


class BracketFilter(SimpleFilter):
    """A message_filters filter: scan in, (scan, the JointSamples that bracket it) out.

    Scans leave in the order in which they came. One that cannot be bracketed is given to `on_drop`
    with the reason: the history begins after its first beam, or no later joint state came before
    the deadline.

    Parameters
    ----------
    scan_filter
        Filter whose messages are LaserScans.
    joint_filter
        Filter whose messages are the stamps [ns] and positions [rad] of joint samples.
    duration_ns
        Tells the time from a scan's first to its last beam [ns].
    deadline
        Longest time that a scan waits [s].
    now_ns
        The clock by which it waits [ns].
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
        super().__init__()
        self._history = JointHistory()
        self._duration_ns = duration_ns
        self._deadline_ns = round(deadline * NS_PER_S)
        self._now_ns = now_ns
        self._on_drop = on_drop
        self._margin_ns = margin_ns
        self._waiting: deque[tuple[int, LaserScan]] = deque()
        scan_filter.registerCallback(self._add_scan)
        joint_filter.registerCallback(self._add_sample)

    def release(self) -> None:
        """Release or drop every scan that can be by now; for the deadline, call it by a timer."""
        while self._waiting and self._settled(*self._waiting[0]):
            self._waiting.popleft()

    def _add_sample(self, stamp_ns: int, pitch: float) -> None:
        """Go on with the scans that wait; forget the history when time went back."""
        newest_ns = self._history.newest_ns
        if newest_ns is not None and newest_ns - stamp_ns > TIME_JUMP_NS:
            self._history.clear()
            while self._waiting:
                self._on_drop(self._waiting.popleft()[1], self.TIME_WENT_BACK)
        self._history.add(stamp_ns, pitch)
        self.release()

    def _add_scan(self, scan: LaserScan) -> None:
        self._waiting.append((self._now_ns(), scan))
        self.release()

    def _settled(self, arrival_ns: int, scan: LaserScan) -> bool:
        start_ns = time_ns(scan.header.stamp)
        end_ns = start_ns + self._duration_ns(scan)
        history, margin_ns = self._history, self._margin_ns
        last = history.after(end_ns + margin_ns)
        if last is None and self._now_ns() - arrival_ns <= self._deadline_ns:
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
