"""The clock of an emulated URG-04LX, and its motor."""

import math

from nodlidar_common.scip import TIMER_BITS
from nodlidar_sim.devices.scip_models import ScipModel, URG_04LX_UG01
from nodlidar_sim.devices.urg_scan import Revolution

_TIMER_RANGE = 1 << TIMER_BITS
_NS_PER_MINUTE = 60e9


class UrgClock:
    """Timer and revolutions of the sensor, both paced by its oscillator.

    Parameters
    ----------
    start_ns
        Host time of power-up [ns].
    rate
        Seconds of the sensor in a second of the host.
    timer
        Reading of the timer at power-up [ms].
    phase
        Fraction of a revolution that is over at power-up, in [0, 1).
    model
        Of the lidar.

    Attributes
    ----------
    model
        The same.
    revolution
        The current revolution.
    speed
        Of the motor from the next revolution on [rpm].
    """

    def __init__(
        self,
        start_ns: int,
        rate: float,
        timer: float,
        phase: float,
        model: ScipModel = URG_04LX_UG01,
    ) -> None:
        self.model, self.speed = model, model.speed
        self._rate = rate
        self._timer_ns, self._timer = start_ns, timer
        self._origin_ns = start_ns - round(phase * self._revolution_ns())
        self._period_ns = self._revolution_ns()
        self._index = 0
        self.revolution = self._make_revolution()

    def timer(self, now_ns: int) -> int:
        """Return the reading of the timer [ms] at a host time [ns]."""
        elapsed = (now_ns - self._timer_ns) * self._rate / 1e6
        return math.floor(self._timer + elapsed) % _TIMER_RANGE

    def reset_timer(self, now_ns: int) -> None:
        """Set the timer to 0 at a host time [ns]."""
        self._timer_ns, self._timer = now_ns, 0.0

    def next_revolution(self) -> None:
        """Begin the next revolution, at the speed set by now."""
        self._index += 1
        if self._period_ns != self._revolution_ns():
            self._origin_ns, self._index = self.revolution.end_ns, 0
            self._period_ns = self._revolution_ns()
        self.revolution = self._make_revolution()

    def skip_to(self, now_ns: int) -> None:
        """Advance to the revolution that contains a host time [ns]."""
        if self.revolution.end_ns <= now_ns:
            self.next_revolution()
        if self.revolution.end_ns <= now_ns:
            index = int((now_ns - self._origin_ns) / self._period_ns)
            self._index = index if self._start_ns(index + 1) > now_ns else index + 1
            self.revolution = self._make_revolution()

    def _revolution_ns(self) -> float:
        return _NS_PER_MINUTE / self.speed / self._rate

    def _start_ns(self, index: int) -> int:
        return self._origin_ns + round(index * self._period_ns)

    def _make_revolution(self) -> Revolution:
        start_ns = self._start_ns(self._index)
        end_ns = self._start_ns(self._index + 1)
        return Revolution(start_ns, end_ns, self.timer(start_ns), self.model)
