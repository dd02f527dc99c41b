"""The motion of an ideal servo that receives goals while it moves."""

from __future__ import annotations

from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array, Times
from nodlidar_common.dynamics import REVERSAL_ACCELERATION
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.nod_motion import (
    PiecewiseMotion,
    SINCE_EVER_NS,
)
from nodlidar_sim.world.servo.firmware import check_goal, Compliance
import numpy as np


@dataclass(frozen=True, slots=True)
class Piece:
    """A duration [s] at a constant acceleration [rad/s^2]."""

    duration: float
    acceleration: float


def trapezoid(
    distance: float, velocity: float, speed_limit: float, acceleration: float
) -> list[Piece]:
    """Return the fastest motion to rest at a distance, from an initial velocity, within limits.

    Parameters
    ----------
    distance
        From here to the goal [rad], signed.
    velocity
        Initial velocity [rad/s]; reduced first if above the speed limit.
    speed_limit, acceleration
        Positive bounds [rad/s, rad/s^2].

    Notes
    -----
    Full braking ends on one side of the goal; the motion is in the direction from there to the
    goal. With this direction positive, the peak speed without a limit follows from
    v0^2 + 2 a s1 = vp^2 = 2 a s2 and s1 + s2 = s.
    """
    braking_distance = velocity * abs(velocity) / (2.0 * acceleration)
    side = math.copysign(1.0, distance - braking_distance)
    start = side * velocity
    peak = math.sqrt(max(0.0, acceleration * side * distance + start**2 / 2.0))
    top = min(peak, speed_limit)
    change = math.copysign(acceleration, top - start)
    speed_up, slow_down = abs(top - start) / acceleration, top / acceleration
    ramps = (start + top) / 2.0 * speed_up + top / 2.0 * slow_down
    cruise = max(0.0, side * distance - ramps) / top if top > 0.0 else 0.0
    return [
        Piece(speed_up, side * change),
        Piece(cruise, 0.0),
        Piece(slow_down, -side * acceleration),
    ]


class IdealServo:
    """The past motion of a servo's shaft, and the future one without further goals.

    Parameters
    ----------
    position
        Initial angle, at rest [rad].
    acceleration
        Of every change of speed [rad/s^2].
    jitter
        Reversals are late by |N(0, jitter)| [s].
    seed
        Of the jitter.
    history
        For which the past is kept [s]; earlier times raise ParameterError.
    """

    def __init__(
        self,
        position: float = 0.0,
        acceleration: float = REVERSAL_ACCELERATION,
        jitter: float = 0.0,
        seed: int = 0,
        history: float = 5.0,
    ) -> None:
        self.acceleration = acceleration
        self._history_ns = round(history * NS_PER_S)
        self._delay = _ReversalDelay(jitter, seed) if jitter > 0.0 else None
        self._pieces = PiecewiseMotion(
            np.array([SINCE_EVER_NS]), np.array([position]), np.zeros(1), np.zeros(1)
        )

    def position(self, times_ns: Times) -> Array:
        """Return the angle [rad] at each time [ns]."""
        return self._pieces.position(times_ns)

    def velocity(self, times_ns: Times) -> Array:
        """Return the speed [rad/s] at each time [ns]."""
        return self._pieces.velocity(times_ns)

    def shaft_position(self, times_ns: Times) -> Array:
        """Return the same as position: there is no backlash."""
        return self.position(times_ns)

    def encoder(self, times_ns: Times) -> Array:
        """Return the same as position: the device rounds it."""
        return self.position(times_ns)

    def measured(self, now_ns: int) -> tuple[float, float]:
        """Return angle [rad] and speed [rad/s] at a time [ns]: the device rounds them.

        FaultyServo overrides it: the motion does not depend on what is measured.
        """
        return self._pieces.at(now_ns)

    def load(self, now_ns: int) -> float:
        """Return 0: nothing resists an ideal servo."""
        return 0.0

    def set_compliance(self, now_ns: int, registers: Compliance) -> None:
        """Do nothing: an ideal servo needs no position loop."""

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Move to an angle [rad] and rest there, from a time [ns] on, at a limited speed [rad/s].

        Raises
        ------
        ParameterError
            If the goal is not finite, the speed limit not positive, or the time too long ago.
        """
        check_goal(goal, speed_limit)
        start_ns = now_ns
        if self._delay is not None:
            position, velocity = self._pieces.at(now_ns)
            start_ns = self._delay.apply(now_ns, goal - position, velocity)
        position, velocity = self._pieces.at(start_ns)
        profile = trapezoid(goal - position, velocity, speed_limit, self.acceleration)
        self._follow(start_ns, profile, goal)

    def reach(self, now_ns: int, end_ns: int, position: float, velocity: float) -> None:
        """Be at an angle [rad] with a velocity [rad/s] at an end, from a time on [ns]; and go on.

        The speed changes evenly up to the middle of this time, and from there on; if both changes
        are the same, the acceleration is constant.
        """
        begin, before = self._pieces.at(now_ns)
        half = (end_ns - now_ns) / NS_PER_S / 2.0
        middle = (position - begin) / half - (before + velocity) / 2.0
        changes = middle - before, velocity - middle
        profile = [Piece(half, change / half) for change in changes]
        self._follow(now_ns, profile, position, velocity)

    def brake(self, now_ns: int) -> None:
        """Brake to rest from a time [ns] on, as a geared servo without torque."""
        position, velocity = self._pieces.at(now_ns)
        stop = Piece(
            abs(velocity) / self.acceleration, -math.copysign(self.acceleration, velocity)
        )
        self._follow(now_ns, [stop], position + velocity * stop.duration / 2.0)

    def _follow(
        self, start_ns: int, profile: list[Piece], goal: float, speed: float = 0.0
    ) -> None:
        """Replace the motion after start_ns by a profile that ends at a goal, with a speed."""
        position, velocity = self._pieces.at(start_ns)
        starts_ns, rows, elapsed = [start_ns], [], 0.0
        for piece in profile:
            rows.append((position, velocity, piece.acceleration))
            position += (velocity + 0.5 * piece.acceleration * piece.duration) * piece.duration
            velocity += piece.acceleration * piece.duration
            elapsed += piece.duration
            starts_ns.append(start_ns + round(elapsed * NS_PER_S))
        rows.append((goal, speed, 0.0))
        self._pieces = _spliced(
            self._pieces, np.array(starts_ns), np.array(rows), self._history_ns
        )


class _ReversalDelay:
    """Delays each reversal of a servo, once for any number of goals in the new direction."""

    def __init__(self, deviation: float, seed: int) -> None:
        self._deviation = deviation
        self._rng = np.random.default_rng(seed)
        self._direction = 0.0
        self._ready_ns = 0

    def apply(self, now_ns: int, distance: float, velocity: float) -> int:
        """Return when [ns] a goal at a distance [rad] takes effect, at a velocity [rad/s]."""
        if distance * velocity >= 0.0:
            self._direction = 0.0
            return now_ns
        if self._direction != math.copysign(1.0, distance):
            self._direction = math.copysign(1.0, distance)
            late = abs(self._rng.normal(0.0, self._deviation))
            self._ready_ns = now_ns + round(late * NS_PER_S)
        return max(now_ns, self._ready_ns)


def _spliced(
    past: PiecewiseMotion, starts_ns: Times, rows: Array, history_ns: int
) -> PiecewiseMotion:
    """Return the past of the history's length up to starts_ns[0], followed by the rows."""
    begin, end = np.searchsorted(past.starts_ns, [starts_ns[0] - history_ns, starts_ns[0]])
    kept = slice(max(0, begin - 1), end)
    positions, velocities, accelerations = rows.T
    return PiecewiseMotion(
        np.concatenate([past.starts_ns[kept], starts_ns]),
        np.concatenate([past.positions[kept], positions]),
        np.concatenate([past.velocities[kept], velocities]),
        np.concatenate([past.accelerations[kept], accelerations]),
    )
