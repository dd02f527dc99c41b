"""Scans that wait, in the order in which they came, for what they need."""

from collections import deque
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

MOST_WAITING = 1000
"""More do not wait: the longest deadline has a hundred scans a second do so."""

Waiting = TypeVar('Waiting')
Found = TypeVar('Found')


class WaitingLine(Generic[Waiting, Found]):
    """Whatever waits leaves in the order in which it came.

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
        """Let something wait from an instant [ns] on."""
        self._waiting.append((now_ns, waiting))

    def leave(
        self, now_ns: int, find: Callable[[Waiting, bool], Found | None]
    ) -> Iterator[tuple[Waiting, Found]]:
        """Yield what leaves at an instant [ns], with what was found for it.

        Parameters
        ----------
        now_ns
            The instant, by the clock of `add`.
        find
            Given what waits, and whether it is overdue: returns what was found for it, or None
            if it is to wait on, which it may not if it is overdue.
        """
        while self._waiting:
            is_full = len(self._waiting) > MOST_WAITING
            # Taken out first: a scan that makes something fail must not do so again and again.
            since_ns, waiting = first = self._waiting.popleft()
            # A clock that was set back makes the wait negative; it must not become an endless one.
            in_time = 0 <= now_ns - since_ns <= self._deadline_ns
            found = find(waiting, is_full or not in_time)
            if found is None:
                self._waiting.appendleft(first)
                return
            yield waiting, found

    def clear(self) -> list[Waiting]:
        """Let all leave; return them."""
        left = [waiting for _, waiting in self._waiting]
        self._waiting.clear()
        return left
