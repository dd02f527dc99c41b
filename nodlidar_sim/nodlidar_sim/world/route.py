"""Routes of the base and of people, in closed form at any instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.planar import advance, compose, displacement, motion_of, relative
import numpy as np
from numpy.typing import NDArray

Velocity = tuple[float, float]  # forward speed [m/s] and turn rate [rad/s]

STANDING: Velocity = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of a route with constant velocity (forward speed m/s, turn rate rad/s).

    Raises
    ------
    ParameterError
        If the duration is shorter than a nanosecond.
    """

    duration: float
    velocity: Velocity

    def __post_init__(self) -> None:
        if not self.duration_ns > 0:
            raise ParameterError('duration', 'above 0 s', self.duration)

    @property
    def duration_ns(self) -> int:
        """The duration [ns]."""
        return round(self.duration * NS_PER_S)


@dataclass(frozen=True, slots=True)
class Plan:
    """A route without start pose and start time.

    Attributes
    ----------
    velocity
        After the legs, without end [m/s, rad/s].
    legs
        Driven first.
    repeat
        Repeat the legs without end, each time from where they ended; requires legs, and excludes a
        velocity.

    Raises
    ------
    ParameterError
        If a plan with `repeat` has no legs, or a velocity.
    """

    velocity: Velocity = STANDING
    legs: tuple[Leg, ...] = ()
    repeat: bool = False

    def __post_init__(self) -> None:
        if self.repeat and not self.legs:
            raise ParameterError('legs', 'given if they are to repeat', [])
        if self.repeat and self.velocity != STANDING:
            raise ParameterError('velocity', '0 0 if the legs repeat', list(self.velocity))

    @property
    def drives(self) -> bool:
        """Whether it ever moves or turns."""
        return any(velocity != STANDING for velocity in self._velocities)

    @property
    def _velocities(self) -> list[Velocity]:
        return [*(leg.velocity for leg in self.legs), self.velocity]

    def route(self, start: Sequence[float], start_ns: int) -> Route:
        """Return the route from a pose (x [m], y [m], yaw [rad]) at a time [ns]."""
        durations_ns = [leg.duration_ns for leg in self.legs]
        starts_ns = start_ns + np.cumsum([0, *durations_ns], dtype=np.int64)
        twists = np.array([(speed, 0.0, rate) for speed, rate in self._velocities])
        poses = [np.array([start], dtype=np.float64)]
        for twist, duration_ns in zip(twists, durations_ns, strict=False):
            poses.append(advance(poses[-1], twist[None] * (duration_ns / NS_PER_S)))
        return Route(starts_ns, np.concatenate(poses), twists, self.repeat)


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """Pieces of constant twist in the plane, at rest before the first.

    Attributes
    ----------
    starts_ns
        Begin of each piece [ns], ascending, shape (k,).
    starts
        x [m], y [m], yaw [rad] at the begin of each piece, shape (k, 3).
    twists
        Speed ahead and to the left [m/s] and turn rate [rad/s] of each piece, shape (k, 3).
    repeat
        Start again with the first piece when and where the last one would begin. Otherwise the
        last one has no end.
    """

    starts_ns: Times
    starts: Array
    twists: Array
    repeat: bool = False
    _lap: Array = field(init=False)
    _lap_motion: Array = field(init=False)

    def __post_init__(self) -> None:
        lap = relative(self.starts[:1], self.starts[-1:])
        object.__setattr__(self, '_lap', lap)
        object.__setattr__(self, '_lap_motion', motion_of(lap))

    @property
    def stands(self) -> bool:
        """Whether it never moves."""
        return not self.twists.any()

    @property
    def top_speed(self) -> float:
        """The greatest speed [m/s]."""
        return float(np.hypot(*self.twists[:, :2].T).max())

    def poses(self, times_ns: Times) -> Array:
        """Return x, y, yaw at each time [ns], shape (n, 3); (1, 3) if it never moves."""
        if self.stands:
            return self.starts[:1]
        elapsed_ns = np.maximum(np.asarray(times_ns, dtype=np.int64) - self.starts_ns[0], 0)
        begun_ns = self.starts_ns - self.starts_ns[0]
        laps = np.zeros_like(elapsed_ns)
        if self.repeat:
            laps, elapsed_ns = np.divmod(elapsed_ns, begun_ns[-1])
        piece = np.searchsorted(begun_ns, elapsed_ns, side='right') - 1
        elapsed = (elapsed_ns - begun_ns[piece]) / NS_PER_S
        starts = self._starts_of(laps, piece) if self.repeat else _each(self.starts, piece)
        return advance(starts, (_each(self.twists, piece).T * elapsed).T)

    def _starts_of(self, laps: Times, piece: NDArray[np.intp]) -> Array:
        """Return the starts of pieces in laps, that many times the motion of one lap away.

        Each is computed once, since they are few for many times.
        """
        found, which = np.unique(laps * len(self.starts) + piece, return_inverse=True)
        laps, piece = np.divmod(found, len(self.starts))
        moved = displacement(self._lap_motion * laps[:, None])
        moved[:, 2] = self._lap[0, 2] * laps
        in_lap = relative(self.starts[:1], self.starts[piece])
        return _each(compose(compose(self.starts[:1], moved), in_lap), which)


def _each(rows: Array, numbers: NDArray[np.intp]) -> Array:
    """Return rows[numbers] with contiguous columns, for faster arithmetic."""
    return np.asarray(rows.T.take(numbers, axis=1).T)
