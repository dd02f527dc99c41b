"""The servo's firmware: a reference that moves to the goal, and the position loop."""

from __future__ import annotations

from dataclasses import dataclass
import math

from nodlidar_common.errors import ParameterError
from nodlidar_sim.world.servo.parameters import PERIOD, ServoParameters


@dataclass(frozen=True, slots=True)
class Compliance:
    """The registers of an RX or AX servo that shape its position loop.

    Attributes
    ----------
    margin_up, slope_up
        For torque that raises the pitch: error without effect, and further error at which the duty
        is 1 [ticks].
    margin_down, slope_down
        The same for torque that lowers it.
    punch
        Least duty beyond the margin.
    torque_limit
        Highest duty.
    gain
        P gain over that of the parameters, of servos without compliance.
    """

    margin_up: float
    slope_up: float
    margin_down: float
    slope_down: float
    punch: float
    torque_limit: float
    gain: float = 1.0


Loop = tuple[float, float, float]
"""Reference [rad], integral and last error [rad] of the position loop."""


class Firmware:
    """Computes the duty, once in a period, from the position as the encoder reports it.

    The moving speed is that of a reference, which moves to the goal, as with the profile of newer
    servos; what the RX-24F does inside is not published. The duty is p_gain times the error
    beyond the margin, at least the punch, plus integral and change, within the torque limit.
    """

    def __init__(self, parameters: ServoParameters) -> None:
        p = parameters
        self._p = p
        self._limit = p.torque_limit
        self._punch = p.punch
        self._up = self._down = p.margin * p.tick, p.p_gain

    def set_compliance(self, registers: Compliance) -> None:
        """Apply registers; those of the position loop only if the servo has them."""
        tick = self._p.tick
        self._limit = min(registers.torque_limit, self._p.torque_limit)
        if self._p.compliance:
            self._punch = registers.punch
            self._up = registers.margin_up * tick, 1.0 / (registers.slope_up * tick)
            self._down = registers.margin_down * tick, 1.0 / (registers.slope_down * tick)
        else:
            self._up = self._down = self._p.margin * tick, self._p.p_gain * registers.gain

    def step(self, loop: Loop, reading: float, goal: float, speed: float) -> tuple[float, Loop]:
        """Return the duty and the loop after a period.

        Parameters
        ----------
        loop
            Before it.
        reading
            Position by the encoder [rad].
        goal, speed
            Where the reference goes [rad], and its speed [rad/s].
        """
        reference, integral, last = loop
        way, most = goal - reference, speed * PERIOD
        reference = goal if abs(way) <= most else reference + math.copysign(most, way)
        error = reference - reading
        duty = self._proportional(error)
        p = self._p
        if p.i_gain > 0.0:
            integral = min(max(integral + p.i_gain * error * PERIOD, -1.0), 1.0)
        if p.d_gain > 0.0:
            duty += p.d_gain * (error - last) / PERIOD
        duty = min(max(duty + integral, -self._limit), self._limit)
        return duty, (reference, integral, error)

    def _proportional(self, error: float) -> float:
        margin, gain = self._up if error > 0.0 else self._down
        beyond = abs(error) - margin
        return math.copysign(max(gain * beyond, self._punch), error) if beyond > 0.0 else 0.0


def check_goal(goal: float, speed_limit: float) -> None:
    """Raise ParameterError unless goal [rad] and speed limit [rad/s] make a motion."""
    if not math.isfinite(goal):
        raise ParameterError('goal', 'finite', goal)
    if not speed_limit > 0.0:
        raise ParameterError('speed_limit', 'above 0 rad/s', speed_limit)
