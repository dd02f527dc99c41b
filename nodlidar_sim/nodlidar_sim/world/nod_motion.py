"""The nod's motion: pieces of constant acceleration, in closed form at any instant."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Any, Protocol

from nodlidar_common.arrays import Array, Times
from nodlidar_common.dynamics import REVERSAL_ACCELERATION
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.servo.firmware import Compliance
import numpy as np
from numpy.typing import NDArray

SINCE_EVER_NS = -(2**62)  # earlier than any stamp; differences do not overflow


class Motion(Protocol):
    """The motion of a joint, at instants covered by its history: shape of the times in and out."""

    def position(self, times_ns: Times) -> Array:
        """Return the angle [rad] at each time [ns]."""

    def velocity(self, times_ns: Times) -> Array:
        """Return the angular velocity [rad/s] at each time [ns]."""


class ServoShaft(Motion, Protocol):
    """A servo that receives goals; the motion is the lidar's, which may differ from the shaft's.

    Its commands are those of IdealServo and PhysicalServo.
    """

    def shaft_position(self, times_ns: Times) -> Array:
        """Return the angle of the shaft [rad] at each time [ns]."""

    def encoder(self, times_ns: Times) -> Array:
        """Return the angle [rad] that the servo measures at each time [ns]."""

    def measured(self, now_ns: int) -> tuple[float, float]:
        """Return angle by the encoder [rad] and speed of the shaft [rad/s] at a time [ns]."""

    def load(self, now_ns: int) -> float:
        """Return the motor's torque as a share of that at standstill, -1 to 1."""

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Move to an angle [rad], from a time [ns] on, at a limited speed [rad/s]."""

    def reach(self, now_ns: int, end_ns: int, position: float, velocity: float) -> None:
        """Be at an angle [rad] with a velocity [rad/s] at an end, from a time on [ns]."""

    def brake(self, now_ns: int) -> None:
        """Switch the torque off, from a time [ns] on."""

    def set_compliance(self, now_ns: int, registers: Compliance) -> None:
        """Apply the registers of the position loop, from a time [ns] on."""


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseMotion:
    """Pieces of constant acceleration; the last one has no end.

    Attributes
    ----------
    starts_ns
        When each piece begins [ns], ascending, shape (k,).
    positions, velocities, accelerations
        Angle [rad], speed [rad/s] and acceleration [rad/s^2] with which it begins, shape (k,).
    """

    starts_ns: Times
    positions: Array
    velocities: Array
    accelerations: Array

    def position(self, times_ns: Times) -> Array:
        """Return the angle [rad] at each time [ns]; raises ParameterError before the start."""
        piece, elapsed = self._locate(times_ns)
        speed = self.velocities[piece] + 0.5 * self.accelerations[piece] * elapsed
        return self.positions[piece] + speed * elapsed

    def velocity(self, times_ns: Times) -> Array:
        """Return the speed [rad/s] at each time [ns]; raises ParameterError before the start."""
        piece, elapsed = self._locate(times_ns)
        return self.velocities[piece] + self.accelerations[piece] * elapsed

    def at(self, time_ns: int) -> tuple[float, float]:
        """Return angle [rad] and speed [rad/s] at one time [ns], much sooner than by arrays."""
        piece = int(self.starts_ns.searchsorted(time_ns, side='right')) - 1
        if piece < 0:
            raise self._too_early(time_ns)
        elapsed = (time_ns - int(self.starts_ns[piece])) / NS_PER_S
        speed, acceleration = float(self.velocities[piece]), float(self.accelerations[piece])
        position = float(self.positions[piece]) + (speed + 0.5 * acceleration * elapsed) * elapsed
        return position, speed + acceleration * elapsed

    def _locate(self, times_ns: Times) -> tuple[NDArray[np.intp], Array]:
        """Return the piece that each time lies in, and the time [s] since that began."""
        times = np.asarray(times_ns, dtype=np.int64)
        piece = np.searchsorted(self.starts_ns, times, side='right') - 1
        if times.size and piece.min() < 0:
            raise self._too_early(int(times.min()))
        return piece, (times - self.starts_ns[piece]) / NS_PER_S

    def _too_early(self, time_ns: int) -> ParameterError:
        limit = f'at or after the start of the motion, {self.starts_ns[0]} ns'
        return ParameterError('times_ns', limit, time_ns)


def blended_motion(knots_ns: Times, knots: Array, acceleration: float) -> PiecewiseMotion:
    """Join straight lines through knots (time [ns], angle [rad]), shape (k,) each, by parabolas.

    At a knot, the speed changes with constant acceleration over an interval centred on the knot's
    time. The parabola begins on one line and ends on the other, so outside it the motion is on the
    lines, and inside it cuts the corner: it never passes a knot that is an extreme. The motion
    goes from the first knot to the last, and rests before and after.

    Raises
    ------
    ParameterError
        If a line is too short for the parabolas at both ends.
    """
    durations = np.diff(knots_ns) / NS_PER_S
    speeds = np.concatenate([[0.0], np.diff(knots) / durations, [0.0]])
    changes = np.diff(speeds)
    half_blends = np.abs(changes) / acceleration / 2.0
    room = durations - half_blends[:-1] - half_blends[1:]
    if not (durations > 0.0).all() or room.min() < 0.0:
        limit = f'long enough to reverse at {acceleration} rad/s^2'
        raise ParameterError('sweep_duration', limit, float(durations.min()))
    half_ns = np.ceil(half_blends * NS_PER_S).astype(np.int64)
    half = half_ns / NS_PER_S
    return PiecewiseMotion(
        starts_ns=_interleave(knots_ns - half_ns, knots_ns + half_ns, SINCE_EVER_NS),
        positions=_interleave(knots - speeds[:-1] * half, knots + speeds[1:] * half, knots[0]),
        velocities=_interleave(speeds[:-1], speeds[1:], 0.0),
        accelerations=_interleave(changes / np.maximum(2.0 * half, 1e-9), 0.0 * half, 0.0),
    )


def triangle_motion(
    nod: Nod,
    start_ns: int,
    end_ns: int,
    acceleration: float = REVERSAL_ACCELERATION,
    jitter: float = 0.0,
    seed: int = 0,
) -> PiecewiseMotion:
    """Return the motion of an ideal servo on a nod, from start_ns to end_ns at least.

    The legs coincide with those of the commanded nod, phase included. The reversals are
    parabolas centred on the commanded instants. So each leg keeps the rows of the scan pattern,
    and the limits are never exceeded; the pitch falls short of them by speed**2 / (2 acceleration)
    (0.025 rad at pi rad/s and 200 rad/s^2).

    Parameters
    ----------
    nod
        The commanded nod.
    start_ns, end_ns
        First and last instant at which the motion is required [ns].
    acceleration
        Of the reversals [rad/s^2].
    jitter
        Standard deviation of the reversal instants [s]: white noise, as a phase lock leaves it, so
        it does not accumulate.
    seed
        Of the jitter.

    Raises
    ------
    ParameterError
        If a sweep is too short for its reversals.
    """
    first = math.floor(nod.sweep_at(start_ns)) - 1
    last = math.ceil(nod.sweep_at(end_ns)) + 1
    reversals = np.arange(first, last + 1)
    knots_ns = np.array([nod.reversal_time_ns(int(reversal)) for reversal in reversals])
    if jitter > 0.0:
        errors = np.random.default_rng(seed).normal(0.0, jitter, len(knots_ns))
        knots_ns = knots_ns + np.rint(errors * NS_PER_S).astype(np.int64)
    knots = np.where(reversals % 2 == 0, nod.pitch_min, nod.pitch_max)
    return blended_motion(knots_ns, knots, acceleration)


def _interleave(starts: NDArray[Any], ends: NDArray[Any], before: float) -> NDArray[Any]:
    """Return before, starts[0], ends[0], starts[1], ends[1] ..."""
    pairs = np.stack([starts, ends], axis=1).ravel()
    return np.concatenate([np.array([before], dtype=pairs.dtype), pairs])
