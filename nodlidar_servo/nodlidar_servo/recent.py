"""What the cycles of the last seconds came to."""

from collections import Counter, deque

from nodlidar_common.nod import NS_PER_S

WINDOW = 1.5
"""How far back it goes [s]: what is over is not told of for longer."""

_LEAST = 1.0  # s, before which nothing is told


class Recent:
    """Rates over the last WINDOW, of what is counted on and on."""

    def __init__(self) -> None:
        self._counts: deque[tuple[int, int, Counter[str]]] = deque()

    def clear(self) -> None:
        """Forget all."""
        self._counts.clear()

    def look(self, now_ns: int, samples: int, failures: Counter[str]) -> None:
        """Take the counts of samples and failures so far, at a time [ns]."""
        self._counts.append((now_ns, samples, failures.copy()))
        while len(self._counts) > 2 and now_ns - self._counts[1][0] >= WINDOW * NS_PER_S:
            self._counts.popleft()

    @property
    def duration(self) -> float:
        """The time [s] that is known about; 0 if it is too short to tell anything."""
        if not self._counts:
            return 0.0
        duration = (self._counts[-1][0] - self._counts[0][0]) / NS_PER_S
        return duration if duration >= _LEAST else 0.0

    @property
    def samples(self) -> int:
        """The samples in this time."""
        return self._counts[-1][1] - self._counts[0][1] if self._counts else 0

    @property
    def failures(self) -> Counter[str]:
        """The failures in this time, by reason."""
        return self._counts[-1][2] - self._counts[0][2] if self._counts else Counter()
