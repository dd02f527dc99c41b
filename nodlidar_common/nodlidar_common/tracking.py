"""The goal and the speed that keep a servo on the nod.

The servo drives to a goal at a commanded speed, with a limited acceleration at both ends. Each leg
of the nod is one such drive from limit to limit. Every cycle computes the speed again from the
measured position, so that the limit is reached at the instant of the reversal. This corrects all
errors within each leg, those of the coarse speed register included; they do not accumulate.
"""

from dataclasses import dataclass, replace
import math
from typing import Protocol

from nodlidar_common.dynamics import arrival_speed, cruising_speed, Dynamics
from nodlidar_common.nod import Nod
from nodlidar_common.phase import PhaseLead
from nodlidar_common.stamps import NS_PER_S

HOLD = 0.02
"""The speed is kept from this time [s] before braking on: the quotient of the remaining distance
and time is then mostly the encoder's quantisation."""

CATCH_UP = 2.0
"""Highest speed as a multiple of the nod's: enough for any leg that is possible from rest to rest,
and no wild moves on the way to the nod. From outside of the limits it is a multiple of the
speed that returns within a sweep, if that is higher."""

RETUNING = 0.005
"""A commanded reversal is not taken back if tuning the nod delays it by up to this time [s]."""

_ROUNDING_NS = 1000  # the instant of a reversal, rounded to ns, belongs to the new leg


@dataclass(frozen=True, slots=True)
class Drive:
    """Command to the servo: goal [rad], speed [rad/s], and whether that is too slow."""

    goal: float
    speed: float
    saturated: bool


@dataclass(frozen=True, slots=True)
class NodProgress:
    """How a nod is followed, for other threads; see NodTracker and PhaseLead."""

    nod: Nod
    drive: Drive
    phase_error: float  # s
    lead_ns: int
    measured_ratio: float


class Measured(Protocol):
    """A measurement of the servo: pitch [rad] and velocity [rad/s] at a time [ns]."""

    @property
    def stamp_ns(self) -> int: ...  # noqa: D102
    @property
    def pitch(self) -> float: ...  # noqa: D102
    @property
    def velocity(self) -> float: ...  # noqa: D102


def predicted_pitch(sample: Measured, nod: Nod, now_ns: int) -> float:
    """Return the pitch [rad] at a time [ns], by constant velocity within the limits."""
    pitch = sample.pitch + sample.velocity * (now_ns - sample.stamp_ns) / NS_PER_S
    lower, upper = min(sample.pitch, nod.pitch_min), max(sample.pitch, nod.pitch_max)
    return min(max(pitch, lower), upper)


class NodTracker:
    """Follows a nod, cycle by cycle.

    The nod may be replaced at any time, by another one or by the same one tuned to the lidar's
    clock. Each step starts from a measurement: it drives the servo from its position to a limit of
    the new nod, no faster than CATCH_UP allows. A servo outside of the new limits returns so that
    it is at a limit when the nod is.

    Attributes
    ----------
    nod
        The nod that is followed.
    phase
        Lateness of the servo and the lead that compensates it.
    drive
        Last command to the servo.
    """

    def __init__(self, nod: Nod, dynamics: Dynamics) -> None:
        self.nod = nod
        self.phase = PhaseLead()
        self._dynamics = dynamics
        self.drive = Drive(math.nan, 0.0, False)
        self._direction = 0.0
        self._measured_ns = 0

    def next_reversal_ns(self, now_ns: int) -> int:
        """Return the instant [ns] at which the present leg ends."""
        lead_ns = self.phase.lead_ns
        return self.nod.reversal_time_ns(self._leg(now_ns + lead_ns) + 1) - lead_ns

    @property
    def led(self) -> Nod:
        """The nod, earlier by the lead."""
        return self.lead(self.nod)

    def lead(self, nod: Nod) -> Nod:
        """Return a nod, earlier by the lead."""
        return replace(nod, reference_time_ns=nod.reference_time_ns - self.phase.lead_ns)

    def progress(self) -> NodProgress:
        """Return how the nod is followed at present."""
        phase = self.phase
        return NodProgress(
            self.nod, self.drive, phase.error, phase.lead_ns, phase.drift.measured_ratio
        )

    def measure_phase(self, sample: Measured) -> None:
        """Add a measurement to the phase, unless it is the one of before."""
        if sample.stamp_ns != self._measured_ns:
            cruise = cruising_speed(self.nod, self._dynamics.acceleration)
            self.phase.add(self.nod, sample, cruise)
        self._measured_ns = sample.stamp_ns

    def step(self, now_ns: int, sample: Measured) -> Drive:
        """Return the command to the servo at a time [ns], from its latest measurement."""
        self.measure_phase(sample)
        nod, ahead_ns = self.nod, now_ns + self.phase.lead_ns
        leg = self._leg(ahead_ns)
        direction = _direction(leg)
        goal = _end(nod, direction)
        remaining = (nod.reversal_time_ns(leg + 1) - ahead_ns) / NS_PER_S
        if direction == self._direction and self._is_arriving(remaining):
            self.drive = replace(self.drive, goal=goal)
            return self.drive
        distance = direction * (goal - predicted_pitch(sample, nod, now_ns))
        velocity = direction * sample.velocity
        comes_back, self._direction = self._direction == -direction, direction
        if -distance > (0.0 if comes_back else HOLD * nod.speed):
            return self._come_back(nod, -direction, -distance, remaining, -velocity)
        speed = arrival_speed(max(distance, 0.0), remaining, velocity, self._dynamics.acceleration)
        return self._go(goal, speed, CATCH_UP * nod.speed)

    def _come_back(
        self, nod: Nod, direction: float, distance: float, remaining: float, speed: float
    ) -> Drive:
        """Return from outside: pass the limit at the reversal, with the nod's speed."""
        self._direction = direction
        needed = min(distance / remaining, nod.speed)
        if remaining > HOLD:
            needed = arrival_speed(
                distance, remaining, speed, self._dynamics.acceleration, nod.speed
            )
        return self._go(
            _end(nod, direction), needed, CATCH_UP * nod.speed * max(1.0, distance / nod.span)
        )

    def _go(self, goal: float, speed: float, fastest: float) -> Drive:
        fastest = min(fastest, self._dynamics.max_speed)
        self.drive = Drive(goal, min(speed, fastest), speed > fastest)
        return self.drive

    def _is_arriving(self, remaining: float) -> bool:
        return remaining < self.drive.speed / self._dynamics.acceleration + HOLD

    def _leg(self, ahead_ns: int) -> int:
        """Return the number of the leg at a time [ns] with the lead added."""
        leg = math.floor(self.nod.sweep_at(ahead_ns + _ROUNDING_NS))
        remaining = (self.nod.reversal_time_ns(leg + 1) - ahead_ns) / NS_PER_S
        turned = self._direction == _direction(leg + 1) and remaining < RETUNING
        return leg + 1 if turned else leg


def _direction(leg: int) -> float:
    return 1.0 if leg % 2 == 0 else -1.0


def _end(nod: Nod, direction: float) -> float:
    return nod.pitch_max if direction > 0.0 else nod.pitch_min
