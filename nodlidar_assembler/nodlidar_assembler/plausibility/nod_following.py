"""Whether the joint follows the commanded nod, or stands still, or goes elsewhere."""

import math

from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S

# Joint samples farther apart [ns] do not show how far it moved in between.
_LONGEST_GAP_NS = NS_PER_S // 2
_BEYOND = 0.1  # rad, and share of the nod, by which a servo may overshoot its limits
_CONFIRMED = 2  # nods up and down in a row; the first one has the way to it as well
_APPROACH_NS = 3 * NS_PER_S  # that a joint may need to come to the limits of another nod [ns]


class NodFollowing:
    """Compares how far the joint moves in each nod up and down with the limits of the nod."""

    def __init__(self) -> None:
        self._low = self._high = self._least_span = self._duration = 0.0
        self._few, self._longest_ns = 0, 0
        self._far, self._far_ns = 0, 0  # nods in a row, and their time
        self._limits = self._allowed = self._reached = 0.0, 0.0
        self._last_ns = -_LONGEST_GAP_NS - 1
        self._begin(0, 0.0)

    @property
    def warning(self) -> str:
        """How far the joint moved, if by less than half of the nod, or beyond it; else empty."""
        (low, high), (lower, upper) = self._reached, self._allowed
        if self._few >= _CONFIRMED:
            return f'the joint moves by {high - low:.2f} rad, although a nod is commanded'
        if self._far < _CONFIRMED or self._far_ns < _APPROACH_NS:
            return ''
        return (
            f'the joint moves from {low:.2f} to {high:.2f} rad, although the nod is from '
            f'{lower:.2f} to {upper:.2f}: check the unit, zero and sign of its positions'
        )

    def add(self, time_ns: int, pitch: float, nod: Nod | None) -> None:
        """Add a joint sample [ns], [rad], and the nod that is commanded; None if there is none."""
        if nod is None or not 0 <= time_ns - self._last_ns <= _LONGEST_GAP_NS:
            self._few = self._far = self._far_ns = 0
            self._begin(time_ns, pitch)
        self._last_ns = time_ns
        if nod is None:
            return
        self._low, self._high = min(self._low, pitch), max(self._high, pitch)
        self._least_span = min(self._least_span, nod.span)
        lower, upper = self._limits
        self._limits = min(lower, nod.pitch_min), max(upper, nod.pitch_max)
        self._note_duration(time_ns, 2.0 * nod.sweep_duration)
        follows = self._high - self._low >= self._least_span / 2.0
        if follows:
            self._few = 0
        if time_ns - self._begin_ns > self._duration * NS_PER_S:
            self._few += not follows
            if self._is_beyond():
                self._far, self._far_ns = self._far + 1, self._far_ns + time_ns - self._begin_ns
            else:
                self._far = self._far_ns = 0
            self._reached, self._allowed = (self._low, self._high), self._limits
            self._begin(time_ns, pitch)

    def _is_beyond(self) -> bool:
        """Return whether the joint was outside of all limits of the nod since it began."""
        lower, upper = self._limits
        most = max(_BEYOND, _BEYOND * (upper - lower))
        return bool(self._low < lower - most or self._high > upper + most)

    def _note_duration(self, time_ns: int, duration: float) -> None:
        """Note how long a nod takes up and down [s]; sweeps may differ, as in `interlaced`."""
        if duration >= self._duration or time_ns - self._longest_ns > duration * NS_PER_S:
            self._duration, self._longest_ns = duration, time_ns

    def _begin(self, time_ns: int, pitch: float) -> None:
        self._begin_ns = self._longest_ns = time_ns
        self._low = self._high = pitch
        self._least_span, self._duration = math.inf, 0.0
        self._limits = math.inf, -math.inf
