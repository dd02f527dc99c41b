"""Watches the stamps and the rate of scans: which are wrong, and how many are missing."""

from collections import deque

from nodlidar_assembler.control.revolutions import FEWEST, Revolutions
from nodlidar_common.nod import NS_PER_S

# Stamps that scatter by more [s] do not tell a wrong one.
_MOST_SCATTER = 1e-3
# After a silence of so long [ns] the lidar may have begun anew.
_SILENCE_NS = NS_PER_S
# A stamp that goes back by more [ns] is of another time: no joint sample is remembered so long.
_OTHER_TIME_NS = 10 * NS_PER_S
# As many scans of another rate in a row are needed until it is believed, but no more than before.
_FEWEST_TO_CHANGE, _MOST_TO_CHANGE = 5, FEWEST
_SAME_RATE = 0.1  # share that the rate may differ by
_REMEMBERED = 20  # scans, of which the fewest revolutions from one to the next are the usual ones


class ScanWatch:
    """Compares every scan with the revolutions of the lidar as the scans before told them.

    A lidar that was disturbed or switched off and on is believed after a few scans, or at once
    after a silence. Where stamps scatter by more than a millisecond, none of them is refused.

    Attributes
    ----------
    missing
        Revolutions without a scan, where the lidar usually sends one.
    """

    WRONG_TIME = 'stamp more than 5 ms off the revolutions of the lidar'
    WRONG_RATE = 'time_increment of another rate than before'

    def __init__(self) -> None:
        self.missing = 0
        self._begin(0.0)

    def _begin(self, nominal: float) -> None:
        self._line, self._nominal = Revolutions(), nominal
        self._accepted = self._others = 0
        self._last_ns: int | None = None
        self._turns: deque[int] = deque(maxlen=_REMEMBERED)

    def shift(self, step_ns: int) -> None:
        """Go on as before although the clock was set by a step [ns]."""
        self._line.shift(step_ns)
        if self._last_ns is not None:
            self._last_ns += step_ns

    def refuse(self, stamp_ns: int, nominal: float) -> str:
        """Add a scan; return why it cannot be right, or nothing if it can.

        Parameters
        ----------
        stamp_ns
            Instant of its first beam [ns].
        nominal
            Time of a revolution [s] as it tells; 0 if it does not.
        """
        if nominal <= 0.0:
            return ''
        if self._last_ns is None:
            self._begin(nominal)
        elif not self._is_of_the_rate(nominal):
            return self.WRONG_RATE
        return self._compare(stamp_ns, nominal)

    def _is_of_the_rate(self, nominal: float) -> bool:
        """Tell whether a scan turns as fast as those before; begin anew if enough do not."""
        if abs(nominal / self._nominal - 1.0) <= _SAME_RATE:
            self._others = 0
            return True
        self._others += 1
        if self._others < min(max(self._accepted, _FEWEST_TO_CHANGE), _MOST_TO_CHANGE):
            return False
        self._begin(nominal)
        return True

    def _compare(self, stamp_ns: int, nominal: float) -> str:
        silence_ns = 0 if self._last_ns is None else stamp_ns - self._last_ns
        is_known = self._line.scatter <= _MOST_SCATTER
        before, restarts = self._line.count, self._line.restarts
        is_on_line = self._line.add(stamp_ns, nominal)
        if not is_on_line and not -_OTHER_TIME_NS <= silence_ns <= _SILENCE_NS:
            self.missing += max(round(silence_ns / NS_PER_S / self._line.period) - 1, 0)
            self._begin(nominal)
            self._line.add(stamp_ns, nominal)
        elif is_on_line and self._line.restarts == restarts:
            self._note_missing(self._line.count - before)
        elif not is_on_line and is_known:
            return self.WRONG_TIME
        self._accepted += 1
        self._last_ns = stamp_ns
        return ''

    def _note_missing(self, turns: int) -> None:
        if turns > 0:
            self._turns.append(turns)
            self.missing += turns // min(self._turns) - 1
