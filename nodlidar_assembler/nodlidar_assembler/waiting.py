"""Scans that wait for joint samples and odometry, in the order of arrival."""

from collections import deque
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

# The longest deadline of 10 s at a hundred scans per second.
MOST_WAITING = 1000

Waiting = TypeVar('Waiting')
Found = TypeVar('Found')


class WaitingLine(Generic[Waiting, Found]):
    """A queue with a deadline, released in the order of arrival.

    Parameters
    ----------
    deadline_ns
        Longest wait [ns].
    """

    def __init__(self, deadline_ns: int) -> None:
        self._deadline_ns = deadline_ns
        self._waiting: deque[tuple[int, Waiting]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, waiting: Waiting, now_ns: int) -> None:
        """Add an item that waits from an instant [ns] on."""
        self._waiting.append((now_ns, waiting))

    def release(
        self, now_ns: int, find: Callable[[Waiting, bool], Found | None]
    ) -> Iterator[tuple[Waiting, Found]]:
        """Yield the items that wait no longer, with the result of `find` for each.

        Parameters
        ----------
        now_ns
            Current time, by the clock of `add` [ns].
        find
            Function of an item and whether it is overdue. Returns the result for the item, or
            None if it must wait longer, which an overdue item cannot.
        """
        while self._waiting:
            is_full = len(self._waiting) > MOST_WAITING
            # Removed first, so that an item for which `find` raises does not block the queue.
            since_ns, waiting = first = self._waiting.popleft()
            # The wait is negative after the clock was set back, and would not end in time.
            in_time = 0 <= now_ns - since_ns <= self._deadline_ns
            found = find(waiting, is_full or not in_time)
            if found is None:
                self._waiting.appendleft(first)
                return
            yield waiting, found

    def clear(self) -> list[Waiting]:
        """Remove and return all items."""
        removed = [waiting for _, waiting in self._waiting]
        self._waiting.clear()
        return removed
