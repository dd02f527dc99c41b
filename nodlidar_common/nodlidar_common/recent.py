"""What was counted in the last seconds."""

from collections import Counter, deque

from nodlidar_common.stamps import NS_PER_S


class Recent:
    """What was counted in the last seconds, of counts that only rise.

    Parameters
    ----------
    window
        Shortest time to count over [s]; the actual time is longer by up to the time between two
        additions.
    """

    def __init__(self, window: float) -> None:
        self._window_ns = round(window * NS_PER_S)
        self._counts: deque[tuple[int, Counter[str]]] = deque()

    def clear(self) -> None:
        """Forget all counts."""
        self._counts.clear()

    def add(self, now_ns: int, counts: Counter[str]) -> None:
        """Add the counts so far, at a time [ns]."""
        self._counts.append((now_ns, counts))
        while len(self._counts) > 1 and now_ns - self._counts[1][0] >= self._window_ns:
            self._counts.popleft()

    @property
    def duration(self) -> float:
        """Time between the oldest and the newest counts [s]."""
        return (self._counts[-1][0] - self._counts[0][0]) / NS_PER_S if self._counts else 0.0

    @property
    def counts(self) -> Counter[str]:
        """What was counted in this time."""
        return self._counts[-1][1] - self._counts[0][1] if self._counts else Counter()
