"""The clock of an emulated URG-04LX and the motor that it drives."""

import math

from nodlidar_common.scip import TIMER_BITS
from nodlidar_sim.devices.urg_identity import STANDARD_SPEED
from nodlidar_sim.devices.urg_scan import Turn

_TIMER_RANGE = 1 << TIMER_BITS
_NS_PER_MINUTE = 60e9


class UrgClock:
    """Timer and turns of the sensor, both paced by its own oscillator.

    Parameters
    ----------
    start_ns
        Host time at which it is switched on [ns].
    rate
        Seconds of the sensor in a second of the host.
    timer
        What the timer shows at the start [ms].
    phase
        The part of a turn that is over at the start, in [0, 1).

    Attributes
    ----------
    turn
        The turn under way.
    speed
        Of the motor [rpm], from the next turn on.
    """

    def __init__(self, start_ns: int, rate: float, timer: float, phase: float) -> None:
        self.speed = STANDARD_SPEED
        self._rate = rate
        self._timer_ns, self._timer = start_ns, timer
        self._origin_ns = start_ns - round(phase * self._turn_ns())
        self._period_ns = self._turn_ns()
        self._index = 0
        self.turn = self._make_turn()

    def timer(self, now_ns: int) -> int:
        """Return the timer [ms] at a host time [ns]."""
        elapsed = (now_ns - self._timer_ns) * self._rate / 1e6
        return math.floor(self._timer + elapsed) % _TIMER_RANGE

    def reset_timer(self, now_ns: int) -> None:
        """Set the timer to 0 at a host time [ns]."""
        self._timer_ns, self._timer = now_ns, 0.0

    def next_turn(self) -> None:
        """Begin the turn after this one, at the speed that is set by now."""
        self._index += 1
        if self._period_ns != self._turn_ns():
            self._origin_ns, self._index = self.turn.end_ns, 0
            self._period_ns = self._turn_ns()
        self.turn = self._make_turn()

    def skip_to(self, now_ns: int) -> None:
        """Go on to the turn in which a host time [ns] lies."""
        if self.turn.end_ns <= now_ns:
            self.next_turn()
        if self.turn.end_ns <= now_ns:
            index = int((now_ns - self._origin_ns) / self._period_ns)
            self._index = index if self._start_ns(index + 1) > now_ns else index + 1
            self.turn = self._make_turn()

    def _turn_ns(self) -> float:
        return _NS_PER_MINUTE / self.speed / self._rate

    def _start_ns(self, index: int) -> int:
        return self._origin_ns + round(index * self._period_ns)

    def _make_turn(self) -> Turn:
        start_ns = self._start_ns(self._index)
        return Turn(start_ns, self._start_ns(self._index + 1), self.timer(start_ns))
