"""Tells a driver that begins to stamp its scans in another way from a lidar that began anew."""

from collections import deque
import math

from nodlidar_assembler.inputs.revolutions import GATE_NS
from nodlidar_common.stamps import NS_PER_S

SILENCE_NS = NS_PER_S
"""After a silence of this length [ns] the lidar may have restarted."""

OTHER_TIME_NS = 10 * NS_PER_S
"""A stamp that goes back by more [ns] is of another time: no joint sample is kept this long."""

_REMEMBERED = 300  # scans: half a minute at 10 Hz
_FEWEST = 10  # scans without a jump, of which one is not late
_MOST_NOISE_NS = 20_000_000  # that the least late of them may still be late


class ScanRestamping:
    """The time from stamp to arrival of scans, before and after their stamps jumped.

    A lidar that began anew sends its scans as late as before. If a driver stamps in another way,
    scans come as before, and are later or less late by what the stamps jumped. The least late of
    several scans counts: a host may delay scans, but it never brings them early. Scans that become
    late while their stamps go on say nothing of the stamps.

    Attributes
    ----------
    moved_ns
        By how much stamps are later than at first [ns]. It ends when scans are again as late as
        then after another jump or a restart, or no longer stamped after they arrive.
    """

    def __init__(self) -> None:
        self.moved_ns = 0.0
        self._is_trusted = False
        self._late_at_first_ns = 0  # at least, before the stamps moved
        self.restart()

    def restart(self) -> None:
        """Forget all scans: the next ones may be of any time."""
        self._last_ns: int | None = None
        self._late_ns: deque[int] = deque(maxlen=_REMEMBERED)  # before the last jump
        self._since_ns: list[int] = []  # of the first scans after it
        self._jump_ns = 0.0

    def trust(self) -> None:
        """Take stamps for right as they are now."""
        self.moved_ns, self._is_trusted = 0.0, True

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]."""
        if self._last_ns is not None:
            self._last_ns += step_ns

    def add(self, stamp_ns: int, arrived_ns: int, usual_ns: float) -> None:
        """Add a scan.

        Parameters
        ----------
        stamp_ns, arrived_ns
            Its stamp, and when it arrived [ns].
        usual_ns
            Time from scan to scan [ns], positive.
        """
        late_ns = arrived_ns - stamp_ns
        step_ns = usual_ns if self._last_ns is None else stamp_ns - self._last_ns
        if not -OTHER_TIME_NS <= step_ns <= SILENCE_NS:
            self.restart()
            step_ns = usual_ns
        jump_ns = step_ns - usual_ns
        self._last_ns = stamp_ns
        settled = len(self._since_ns) == _FEWEST
        if abs(jump_ns) > GATE_NS and not self._is_gap(jump_ns, late_ns, usual_ns):
            self._jump_ns = jump_ns + (0.0 if settled else self._jump_ns)
            self._since_ns, settled = [], False
        if settled:
            self._late_ns.append(late_ns)
            return
        self._since_ns.append(late_ns)
        if len(self._since_ns) == _FEWEST:
            self._settle(min(self._since_ns))

    def _is_gap(self, jump_ns: float, late_ns: int, usual_ns: float) -> bool:
        """Return whether a jump is of missing scans: the next one is not early for its stamp."""
        is_whole = jump_ns > 0.0 and abs(math.remainder(jump_ns, usual_ns)) <= GATE_NS
        least_ns = min((*self._late_ns, *self._since_ns), default=late_ns)
        return is_whole and late_ns > least_ns - usual_ns / 2.0

    def _settle(self, late_ns: int) -> None:
        """Judge the last jump by the least lateness of the scans since [ns]."""
        before_ns = min(self._late_ns, default=late_ns)
        noise_ns = min(abs(self._jump_ns) / 2.0, _MOST_NOISE_NS)
        if abs(self._jump_ns) > GATE_NS and abs(before_ns - late_ns - self._jump_ns) < noise_ns:
            if not self.moved_ns:
                self._late_at_first_ns = before_ns
            self.moved_ns += self._jump_ns
            self._late_ns.clear()
        later_ns = self._late_at_first_ns - late_ns
        # Stamped after they arrived: that was wrong, unless the clocks of the machines differ.
        was_ahead = before_ns < -GATE_NS <= late_ns and not self._is_trusted
        if was_ahead or abs(later_ns) < abs(later_ns - self.moved_ns):
            self.moved_ns = 0.0
        self._late_ns.extend(self._since_ns)
