"""Reversals of the nod, found in the joint samples."""

from collections import deque
from itertools import pairwise

from nodlidar_common.time_order import TIME_JUMP_NS

# Return from an extreme that confirms a reversal [rad]: four encoder steps of the RX-24F.
HYSTERESIS = 0.02
# Samples kept while the joint hardly moves: 100 s at 100 Hz.
MOST_SAMPLES = 10_000


class ReversalFinder:
    """Finds reversals in joint samples that are added one by one.

    A reversal is confirmed once the pitch has returned from its extreme by a depth: HYSTERESIS, or
    the largest step between samples of the leg if that is more. Its instant is the middle between
    the crossings of that level before and after the extreme. The motion is symmetric about a
    reversal, and a crossing at full speed is sharp, while the extreme is flat and quantised. At
    that depth, the two samples around a crossing always belong to one leg.
    """

    def __init__(self) -> None:
        self._direction = 0
        self._depth = self._extreme = 0.0
        self._samples: deque[tuple[int, float]] = deque(maxlen=MOST_SAMPLES)

    def add(self, time_ns: int, pitch: float) -> int | None:
        """Add a joint sample [ns], [rad]; return the reversal's instant [ns] once confirmed."""
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
        self._depth = HYSTERESIS
        self._extreme = self._samples[-1][1]

    def _find_direction(self, pitch: float) -> None:
        moved = pitch - self._samples[0][1]
        if abs(moved) >= HYSTERESIS:
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
        """Return when the pitch crossed the level toward the extreme, or away from it [ns]."""
        level = self._level()
        pairs = list(pairwise(self._samples))
        for (t0, p0), (t1, p1) in pairs if toward_extreme else reversed(pairs):
            rising = (p1 - p0) * self._direction > 0.0
            if p0 != p1 and rising == toward_extreme and min(p0, p1) <= level <= max(p0, p1):
                return t0 + round((t1 - t0) * (level - p0) / (p1 - p0))
        # The leg was shorter than the depth, so only its begin is known.
        return self._samples[0][0]

    def _forget(self) -> None:
        """Forget the samples that a crossing can no longer need."""
        level = self._level()
        while len(self._samples) > 2 and (level - self._samples[1][1]) * self._direction >= 0.0:
            self._samples.popleft()
