"""Decides which of the lidar's time stamps to believe: those that continue even revolutions."""

from collections import deque
from itertools import pairwise

IRREGULAR_MS = 1.5  # if a revolution deviates by more, the motor changed its speed
SPEED_RANGE = 0.12  # share by which the motor's speed can be changed (command CR)
_WANDER = 1e-3  # share by which the motor's speed may change while scans are missing
_MOST_MS = 10.0  # however many scans are missing


class StampCheck:
    """Believes stamps that continue the revolutions, and others as soon as they agree.

    A wrong stamp with a correct sum is refused, even the first of a stream, and does not affect
    later ones. A change of the motor's speed costs one or two scans.

    Parameters
    ----------
    nominal_ms
        Nominal time of one revolution [ms].
    hint_ms
        Probable start of a revolution before the first stamp [ms]: if the first stamp agrees with
        it, it is believed at once.

    Attributes
    ----------
    broken
        Whether no speed of the motor explains the last believed stamps: the timer was set.
    """

    def __init__(self, nominal_ms: float, hint_ms: int | None = None) -> None:
        self.broken = False
        self._nominal_ms = nominal_ms
        self._believed: int | None = None
        self._hint = [] if hint_ms is None else [hint_ms]
        self._doubted: deque[int] = deque(maxlen=3)
        self._latest: deque[int] = deque(maxlen=3)

    def believe(self, stamp_ms: int, period_ms: float) -> list[int]:
        """Check the next scan's stamp (without wraps).

        Parameters
        ----------
        stamp_ms
            The stamp [ms].
        period_ms
            Measured time of one revolution, or else the nominal one [ms].

        Returns
        -------
        list of int
            Stamps that are now believed, ascending, this one last; empty if it is in doubt.
        """
        last = self._believed
        self._latest.append(stamp_ms)
        if self._turns_at_another_speed():
            self._doubted.append(stamp_ms)
            believed = []
        elif last is not None and _continues(last, stamp_ms, period_ms):
            believed = [stamp_ms]
        else:
            self._doubted.append(stamp_ms)
            believed = self._agreeing(period_ms)
            if last is not None and believed:
                self.broken = not self._motor_explains(last, believed[0])
        if believed:
            self._believed = believed[-1]
            self._doubted.clear()
            self._hint.clear()
        return believed

    def _turns_at_another_speed(self) -> bool:
        """Return whether the last stamps are even, but at a speed that the motor cannot have.

        Any of them may be a whole number of nominal revolutions after a believed one.
        """
        steps = [later - earlier for earlier, later in pairwise(self._latest)]
        if len(steps) < 2 or max(steps) - min(steps) > IRREGULAR_MS:
            return False
        return not self._motor_explains(self._latest[0], self._latest[1])

    def _agreeing(self, period_ms: float) -> list[int]:
        """Return the newest stamp and one that it continues, or the last three if even."""
        *earlier, newest = self._doubted
        for stamp_ms in (*reversed(earlier), *self._hint):
            if _continues(stamp_ms, newest, period_ms):
                return [stamp_ms, newest]
        if len(earlier) > 1:
            period_ms = (earlier[1] - earlier[0]) / self._revolutions(earlier[0], earlier[1])
            if self._is_a_speed(period_ms) and _continues(earlier[1], newest, period_ms):
                return [*earlier, newest]
        return []

    def _revolutions(self, stamp_ms: int, later_ms: int) -> int:
        return max(round((later_ms - stamp_ms) / self._nominal_ms), 1)

    def _is_a_speed(self, period_ms: float) -> bool:
        return abs(period_ms - self._nominal_ms) <= SPEED_RANGE * self._nominal_ms

    def _motor_explains(self, stamp_ms: int, later_ms: int) -> bool:
        return self._is_a_speed((later_ms - stamp_ms) / self._revolutions(stamp_ms, later_ms))


def _continues(stamp_ms: int, later_ms: int, period_ms: float) -> bool:
    """Return whether a stamp is a whole number of revolutions after another."""
    revolutions = round((later_ms - stamp_ms) / period_ms)
    tolerance_ms = min(IRREGULAR_MS + _WANDER * (revolutions - 1) * period_ms, _MOST_MS)
    return revolutions > 0 and abs(later_ms - stamp_ms - revolutions * period_ms) <= tolerance_ms
