"""Finds the instants at which the measured nod turned around."""

from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise

# A sample that is older than the last one by this much is the first of a clock that was set.
TIME_JUMP_NS = 1_000_000_000
# Remembered of a joint at rest, or nearly so: 100 s at 100 Hz.
MOST_SAMPLES = 10_000


@dataclass(slots=True)
class TurnFinder:
    """Finds reversals in joint samples, given one by one.

    A turn is sure once the pitch has come back from its extreme by a depth: `hysteresis`, or the
    largest step between samples of the leg where that is more. Its instant is the middle between
    the two crossings of that level, before and after the extreme: the motion about a turn is
    symmetric in time, and crossings at full speed are sharp where the extreme itself is flat and
    quantised. With that depth, the two samples about a crossing are always of one leg.

    Attributes
    ----------
    hysteresis
        Least way back from the extreme [rad]; several encoder steps.
    """

    hysteresis: float
    _direction: int = 0
    _depth: float = 0.0
    _extreme: float = 0.0
    _samples: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=MOST_SAMPLES))

    def add(self, time_ns: int, pitch: float) -> int | None:
        """Add the next joint sample; return the instant of a turn [ns] when it has become sure."""
        if self._samples and time_ns <= self._samples[-1][0]:
            if self._samples[-1][0] - time_ns < TIME_JUMP_NS:
                return None
            self._samples.clear()
        self._samples.append((time_ns, pitch))
        if len(self._samples) == 1:
            self._begin_leg(0)
        elif self._direction == 0:
            self._find_direction(pitch)
        else:
            return self._follow_leg(pitch)
        return None

    def _begin_leg(self, direction: int) -> None:
        self._direction = direction
        self._depth = self.hysteresis
        self._extreme = self._samples[-1][1]

    def _find_direction(self, pitch: float) -> None:
        moved = pitch - self._samples[0][1]
        if abs(moved) >= self.hysteresis:
            self._begin_leg(1 if moved > 0.0 else -1)

    def _follow_leg(self, pitch: float) -> int | None:
        self._depth = max(self._depth, abs(pitch - self._samples[-2][1]))
        if (pitch - self._extreme) * self._direction > 0.0:
            self._extreme = pitch
            self._forget()
        if (self._extreme - pitch) * self._direction < self._depth:
            return None
        before = self._crossing(toward_extreme=True)
        after = self._crossing(toward_extreme=False)
        self._begin_leg(-self._direction)
        return before + (after - before) // 2

    def _level(self) -> float:
        return self._extreme - self._direction * self._depth

    def _crossing(self, toward_extreme: bool) -> int:
        """Return when the pitch passed the level on its way to the extreme, or back from it."""
        level = self._level()
        pairs = list(pairwise(self._samples))
        for (t0, p0), (t1, p1) in pairs if toward_extreme else reversed(pairs):
            rising = (p1 - p0) * self._direction > 0.0
            if p0 != p1 and rising == toward_extreme and min(p0, p1) <= level <= max(p0, p1):
                return t0 + round((t1 - t0) * (level - p0) / (p1 - p0))
        # The leg was shorter than the depth: where it began is all that is known.
        return self._samples[0][0]

    def _forget(self) -> None:
        """Forget the samples before the last one that a crossing could begin with."""
        level = self._level()
        while len(self._samples) > 2 and (level - self._samples[1][1]) * self._direction >= 0.0:
            self._samples.popleft()
