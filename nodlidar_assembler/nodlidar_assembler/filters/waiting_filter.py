"""Keeps scans back until what goes with them has come, or it is too late."""

from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Any

from message_filters import SimpleFilter
from nodlidar_common.nod import NS_PER_S
from sensor_msgs.msg import LaserScan

# Scans; the longest deadline has a hundred a second wait.
MOST_WAITING = 1000


class WaitingFilter(SimpleFilter):
    """A message_filters filter whose scans leave in the order in which they came.

    Parameters
    ----------
    source
        Filter whose messages are a LaserScan, and maybe what it has been given already.
    duration_ns
        Tells the time from a scan's first to its last beam [ns].
    deadline
        Longest time that a scan waits [s].
    now_ns
        The clock by which it waits [ns].
    """

    def __init__(
        self,
        source: SimpleFilter,
        duration_ns: Callable[[LaserScan], int],
        deadline: float,
        now_ns: Callable[[], int],
    ) -> None:
        super().__init__()
        self._duration_ns = duration_ns
        self._deadline_ns = round(deadline * NS_PER_S)
        self._now_ns = now_ns
        self._waiting: deque[tuple[int, tuple[Any, ...]]] = deque()
        source.registerCallback(self._add)

    def release(self) -> None:
        """Let every scan go that can by now; for the deadline, call it now and then."""
        while self._waiting:
            # Taken out first: a scan on whose way something fails must not fail again and again.
            arrival_ns, message = waiting = self._waiting.popleft()
            # A clock that was set back makes the wait negative; it must not become an endless one.
            overdue = not 0 <= self._now_ns() - arrival_ns <= self._deadline_ns
            if len(self._waiting) >= MOST_WAITING:
                overdue = True
            if not self._settled(overdue, *message):
                self._waiting.appendleft(waiting)
                return

    def _add(self, *message: Any) -> None:
        self._waiting.append((self._now_ns(), message))
        self.release()

    def _drain(self, on_each: Callable[..., None], reason: str) -> None:
        """Give all that wait to a function, with a reason."""
        while self._waiting:
            _, message = self._waiting.popleft()
            on_each(*message, reason)

    @abstractmethod
    def _settled(self, overdue: bool, scan: LaserScan, *given: Any) -> bool:
        """Pass a scan on or give it up, if that is sure by now; return whether it was."""
