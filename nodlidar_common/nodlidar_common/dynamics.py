"""What a servo can do: the speed for a distance in a duration, and which nods it can follow."""

from dataclasses import dataclass
import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.rounding import rounded_down, rounded_up

REVERSAL_ACCELERATION = 200.0  # of an RX-24F, assumed [rad/s^2]


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What a servo can do: acceleration [rad/s^2], lowest and highest speed [rad/s]."""

    acceleration: float
    min_speed: float
    max_speed: float


def arrival_speed(
    distance: float, duration: float, velocity: float, acceleration: float, final: float = 0.0
) -> float:
    """Return the cruising speed v that covers a distance in a duration.

    Braking from v to the final speed w loses (v - w)^2 / 2a against keeping v, changing from the
    present velocity u to v loses (v - u)^2 / 2a against having v at once, so

        v * duration = distance + (v - w)^2 / 2a + (v - u)^2 / 2a,

    whose lower root is returned. If the servo is already faster (u > v), it has v at once:

        v * duration = distance + (v - w)^2 / 2a.

    Parameters
    ----------
    distance, duration
        Remaining distance [rad], positive, and the time for it [s].
    velocity
        Present velocity u towards the goal [rad/s].
    acceleration
        Acceleration a [rad/s^2].
    final
        Speed w at the end [rad/s].

    Returns
    -------
    float
        The speed [rad/s]; infinite if no speed is high enough.
    """
    reach = acceleration * duration + final
    way = 2.0 * acceleration * distance + final * final
    root = reach * reach - way
    if root >= 0.0 and reach - math.sqrt(root) <= velocity:
        return reach - math.sqrt(root)
    reach += velocity
    root = reach * reach - 2.0 * (way + velocity * velocity)
    return (reach - math.sqrt(root)) / 2.0 if root >= 0.0 and reach > 0.0 else math.inf


def check_nod(nod: Nod, lower: float, upper: float, dynamics: Dynamics) -> None:
    """Check that a mount (pitch limits [rad]) and a servo can follow a nod.

    Raises
    ------
    ParameterError
        Naming the field of the command that is out of its limit.
    """
    for key in ('pitch_min', 'pitch_max'):
        check_pitch(key, getattr(nod, key), (lower, upper))
    if nod.speed < dynamics.min_speed:
        longest = nod.span / dynamics.min_speed
        limit = f'at most {rounded_down(longest)} s, for the lowest speed of the servo'
        raise ParameterError('sweep_duration', limit, nod.sweep_duration)
    speed = cruising_speed(nod, dynamics.acceleration)
    if speed > dynamics.max_speed:
        shortest = rounded_up(shortest_sweep(nod.span, dynamics))
        limit = f'at least {shortest} s, the fastest of the servo'
        raise ParameterError('sweep_duration', limit, nod.sweep_duration)


def check_pitch(key: str, pitch: float, limits: tuple[float, float]) -> None:
    """Raise ParameterError for a pitch beyond the limits of a mount [rad]."""
    if not limits[0] <= pitch <= limits[1]:
        allowed = f'between {limits[0]} and {limits[1]} rad, the limits of the mount'
        raise ParameterError(key, allowed, pitch)


def cruising_speed(nod: Nod, acceleration: float) -> float:
    """Return the speed [rad/s] of a leg from rest to rest; infinite if none is high enough."""
    return arrival_speed(nod.span, nod.sweep_duration, 0.0, acceleration)


def shortest_sweep(span: float, dynamics: Dynamics) -> float:
    """Return the shortest time [s] from rest to rest over a span [rad]."""
    peak = min(dynamics.max_speed, math.sqrt(span * dynamics.acceleration))
    return span / peak + peak / dynamics.acceleration
