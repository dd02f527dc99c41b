"""When scans come: wrong stamps and rates are refused, missing scans counted."""

from collections import deque
from copy import copy
import math

from nodlidar_assembler.inputs.revolutions import FEWEST, GATE_NS, Revolutions, SAME_RATE
from nodlidar_assembler.inputs.scan_restamping import OTHER_TIME_NS, ScanRestamping, SILENCE_NS
from nodlidar_common.stamps import NS_PER_S

# If stamps scatter by more [s], none can be recognised as wrong.
_MOST_SCATTER = 1e-3
# By how much [ns] a motor with a wandering speed is off its own last revolution.
_WANDER_NS = 2_000_000
# Scans of another rate in a row until it is accepted; no more than were accepted before.
_FEWEST_TO_CHANGE, _MOST_TO_CHANGE = 5, FEWEST
_REMEMBERED = 20  # scans; the fewest revolutions between two of them are the usual ones


class ScanTiming:
    """Compares every scan with the revolutions of the lidar, as known from the scans before.

    After a disturbance or a restart of the lidar, its scans are accepted again after a few, or at
    once after a silence. If stamps scatter by more than a millisecond, none is refused; nor is one
    that follows the last one at the speed that it states, as of a motor whose speed wanders.

    Attributes
    ----------
    missing
        Revolutions without a scan that the lidar would usually send.
    """

    WRONG_TIME = f'stamp more than {GATE_NS / 1e6:g} ms off the revolutions of the lidar'
    WRONG_RATE = 'time_increment of another rate than before'

    def __init__(self) -> None:
        self.missing = 0
        self._restamping = ScanRestamping()
        self._restart(0.0)

    def _restart(self, nominal: float) -> None:
        self._line, self._nominal = Revolutions(), nominal
        self._restamping.restart()
        # Line, last stamp and missing revolutions before the stamps jumped, for one scan.
        self._before_jump: tuple[Revolutions, int | None, int] | None = None
        self._accepted = self._others = 0
        self._last_ns: int | None = None
        self._revolutions: deque[int] = deque(maxlen=_REMEMBERED)

    @property
    def restamped(self) -> float:
        """By how much stamps became later [s] while scans came as before; 0 if they did not.

        Those before or those since are wrong.
        """
        return self._restamping.moved_ns / NS_PER_S

    def trust_stamps(self) -> None:
        """Take stamps for right as they are now."""
        self._restamping.trust()

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]."""
        self._line.shift(step_ns)
        self._restamping.shift(step_ns)
        if self._last_ns is not None:
            self._last_ns += step_ns

    def joints_went_back(self) -> None:
        """Note that joint states are of another time: if scans are as well, time has jumped."""
        self._restamping.restart()

    def refuse(self, stamp_ns: int, nominal: float, arrived_ns: int) -> str:
        """Add a scan; return why it must be wrong, or an empty text if it may be right.

        Parameters
        ----------
        stamp_ns
            Instant of its first beam [ns].
        nominal
            Time of a revolution [s] that it states; 0 if it states none.
        arrived_ns
            Instant of its arrival, by the clock of the stamps [ns].
        """
        if self._last_ns is not None and not self._has_same_rate(nominal):
            return self.WRONG_RATE
        if nominal <= 0.0:
            return ''
        if self._last_ns is None:
            self._restart(nominal)
        return self._compare(stamp_ns, nominal, arrived_ns)

    def _has_same_rate(self, nominal: float) -> bool:
        """Return whether a scan has the rate of those before; restart after enough that do not."""
        if abs(nominal / self._nominal - 1.0) <= SAME_RATE:
            self._others = 0
            return True
        self._others += 1
        if self._others < min(max(self._accepted, _FEWEST_TO_CHANGE), _MOST_TO_CHANGE):
            return False
        self._restart(nominal)
        return True

    def _compare(self, stamp_ns: int, nominal: float, arrived_ns: int) -> str:
        self._forget_stray(stamp_ns, nominal)
        silence_ns = 0 if self._last_ns is None else stamp_ns - self._last_ns
        if not -OTHER_TIME_NS <= silence_ns <= SILENCE_NS:
            self._before_jump = copy(self._line), self._last_ns, self.missing
            if not self._line.has(stamp_ns, nominal):
                self.missing += max(round(silence_ns / NS_PER_S / self._line.period) - 1, 0)
                self._line = Revolutions()
        usual = min(self._revolutions, default=1) * (self._line.period or nominal)
        self._restamping.add(stamp_ns, arrived_ns, usual * NS_PER_S)
        is_known = self._line.scatter <= _MOST_SCATTER
        before, restarts = self._line.count, self._line.restarts
        is_on_line = self._line.add(stamp_ns, nominal)
        begins = self._line.restarts > restarts
        if is_on_line and not begins:
            self._note_missing(self._line.count - before)
        elif not is_on_line and is_known and not self._follows(stamp_ns, nominal):
            return self.WRONG_TIME
        self._accepted += 1
        self._last_ns = stamp_ns
        return ''

    def _follows(self, stamp_ns: int, nominal: float) -> bool:
        """Return whether a scan is a few revolutions after the last one, at the stated speed."""
        if self._last_ns is None or stamp_ns <= self._last_ns:
            return False
        off_ns = math.remainder(stamp_ns - self._last_ns, nominal * NS_PER_S)
        return abs(off_ns) <= _WANDER_NS

    def _forget_stray(self, stamp_ns: int, nominal: float) -> None:
        """Continue as before a jump in time if this scan does: the jump was a stray."""
        before, self._before_jump = self._before_jump, None
        if before is None or not before[0].has(stamp_ns, nominal):
            return
        is_new = self._line.count == 0
        if is_new or not self._line.has(stamp_ns, nominal):
            self._line, self._last_ns, self.missing = before

    def _note_missing(self, revolutions: int) -> None:
        if revolutions > 0:
            self._revolutions.append(revolutions)
            self.missing += revolutions // min(self._revolutions) - 1
