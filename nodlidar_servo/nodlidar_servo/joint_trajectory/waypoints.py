"""The nod as waypoints for a controller that draws cubic splines through them.

Each leg goes from rest at one limit to rest at the other, as :mod:`nodlidar_common.dynamics` has
it: an acceleration, a constant speed and a braking. A cubic spline through position and velocity
at the four instants between them is exactly that motion. A controller that gets nothing more after
a plan stops at a limit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
import math

from nodlidar_common.dynamics import cruising_speed, Dynamics
from nodlidar_common.nod import Nod
from nodlidar_common.phase import FASTEST_LEAD, longest_lateness
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import CATCH_UP, Measured
from nodlidar_servo.joint_trajectory.joint_sample import JointSample
from scipy.interpolate import CubicHermiteSpline

HORIZON = 1.0
"""A plan reaches at least this time [s] ahead, and ends at a reversal."""

HELD = 0.5
"""A stop lasts this time [s]: a controller refuses what ends before it arrives."""

_RETURN = 1.0  # rad/s, the highest speed of a joint that comes back from outside of the mount
_NEW = 0.02  # s, the age of a measurement up to which the joint went on as measured
_STEADY = 0.02  # rad, the least distance from the plan of a joint that does not follow it
_SMOOTH = 0.25  # of the speed of the nod, by which tuning changes the velocity, at reversals
_RETIMED = 0.05  # of a sweep, by which tuning moves the reversal that an approach leads to
_SAME_NS = 2_000_000  # between reversals of two nods that are one, tuned at different times
_ROUNDING_NS = 1000  # the instants of reversals are rounded, far from the reference time to 128 ns


@dataclass(frozen=True, slots=True)
class Waypoint:
    """Pitch [rad] and velocity [rad/s] at a time [ns]."""

    time_ns: int
    pitch: float
    velocity: float


def leg(nod: Nod, number: int, acceleration: float) -> list[Waypoint]:
    """Return the four waypoints of a leg, from rest to rest; three if it is never at one speed.

    Parameters
    ----------
    nod
        A nod that the acceleration suffices for.
    number
        Of the leg; even ones go up.
    acceleration
        At the reversals [rad/s^2].
    """
    begin_ns, end_ns = nod.reversal_time_ns(number), nod.reversal_time_ns(number + 1)
    direction = 1.0 if number % 2 == 0 else -1.0
    begin, end = _limit(nod, number), _limit(nod, number + 1)
    speed = cruising_speed(nod, acceleration)
    ramp_ns = round(speed / acceleration * NS_PER_S)
    way, velocity = direction * speed**2 / acceleration / 2.0, direction * speed
    points = [
        Waypoint(begin_ns, begin, 0.0),
        Waypoint(begin_ns + ramp_ns, begin + way, velocity),
        Waypoint(end_ns - ramp_ns, end - way, velocity),
        Waypoint(end_ns, end, 0.0),
    ]
    if points[2].time_ns <= points[1].time_ns:  # all acceleration and braking
        del points[2]
    return points


def stop(
    sample: Measured, now_ns: int, acceleration: float, limits: tuple[float, float]
) -> Waypoint:
    """Return where and when a joint is at rest soonest.

    Parameters
    ----------
    sample, now_ns
        The latest measurement, and the present time [ns].
    acceleration
        Of the braking [rad/s^2].
    limits
        Lowest and highest pitch of the mount [rad], which the joint stops within. From outside of
        them it comes back slowly.
    """
    braking = abs(sample.velocity) / acceleration
    pitch = _within(_coasted(sample, now_ns) + sample.velocity * braking / 2.0, limits)
    outside = abs(sample.pitch - _within(sample.pitch, limits))
    duration = max(braking, _cubic_duration(outside, _RETURN, acceleration))
    return Waypoint(now_ns + max(round(duration * NS_PER_S), 1), pitch, 0.0)


def is_within(sample: Measured, limits: tuple[float, float]) -> bool:
    """Return whether a joint was measured within the limits of the mount [rad], or nearly so."""
    return limits[0] - _STEADY <= sample.pitch <= limits[1] + _STEADY


def held(rest: Waypoint) -> list[Waypoint]:
    """Return the waypoints of a joint that stays where it is at rest."""
    return [rest, replace(rest, time_ns=rest.time_ns + round(HELD * NS_PER_S))]


class Planner:
    """Plans the way of a joint to the nod, and the nod.

    A joint that is not on the nod stops, goes to the limit of the first reversal that it reaches
    in time, and begins there. One that is measured outside of the mount is first at rest there: a
    plan that runs is not changed before it ends at rest.

    Parameters
    ----------
    dynamics
        What the joint can do.
    limits
        Lowest and highest pitch of the mount [rad].
    """

    def __init__(self, dynamics: Dynamics, limits: tuple[float, float]) -> None:
        self._dynamics = dynamics
        self._limits = limits
        self._plan: list[Waypoint] = []
        self._planned_ns = 0
        self._joins_ns = 0  # reversal at which the approach in the plan ends

    def plan(
        self, nod: Nod, sample: Measured, now_ns: int, after: tuple[Nod, int] | None = None
    ) -> list[Waypoint]:
        """Return the waypoints from the present leg or approach on.

        Parameters
        ----------
        nod
            The nod, earlier by the lead.
        sample
            The latest measurement of the joint.
        now_ns
            The present time [ns].
        after
            The nod that replaces it, earlier by the lead too, and its start [ns]; None for none.
        """
        before: list[Waypoint] = []
        if not is_within(sample, self._limits) and self._plan and now_ns < self._plan[-1].time_ns:
            return self._plan
        if self._plan and now_ns < self._joins_ns and self._leads_to(nod):
            before, first = self._plan[:1], round(nod.sweep_at(self._joins_ns))
        elif self._continues(nod, now_ns) and self.follows(nod, sample):
            first = math.floor(nod.sweep_at(now_ns))
        else:
            rest = self._rest(sample, now_ns)
            before, first = [rest], self._first_reached(rest, nod)
        if before:
            self._joins_ns = nod.reversal_time_ns(first)
        self._plan = [*before, *self._legs(nod, first, now_ns, after)]
        self._planned_ns = now_ns
        return self._plan

    def hold(self, sample: Measured, now_ns: int) -> list[Waypoint]:
        """Plan and return the waypoints of a joint that stops as soon as it can."""
        self._plan, self._joins_ns = held(self._rest(sample, now_ns)), 0
        self._planned_ns = now_ns
        return self._plan

    def _rest(self, sample: Measured, now_ns: int) -> Waypoint:
        """Return where and when the joint is at rest soonest.

        Where it is at present [ns] tells the latest measurement, or the plan if that is not new.
        If it is where the other one has it, it is not hurried from there.
        """
        acceleration = self._dynamics.acceleration
        other = JointSample(now_ns, sample.pitch, sample.velocity)
        believed = replace(other, pitch=_coasted(sample, now_ns))
        if self._plan and self._plan[0].time_ns <= now_ns:
            planned = JointSample(now_ns, *_at(self._plan, min(now_ns, self._plan[-1].time_ns)))
            believed, other = (believed, planned) if _is_new(sample, now_ns) else (planned, other)
        rest = stop(believed, now_ns, acceleration, self._limits)
        duration = max(
            _cubic_duration(
                abs(other.pitch - believed.pitch), self._dynamics.max_speed, acceleration
            ),
            abs(other.velocity) / acceleration,
        )
        return replace(rest, time_ns=max(rest.time_ns, now_ns + round(duration * NS_PER_S)))

    def follows(self, nod: Nod, sample: Measured) -> bool:
        """Return whether a joint is on the nod, up to LOCKED late or early."""
        pitch, _ = self._state(nod, sample.stamp_ns)
        cruise = cruising_speed(nod, self._dynamics.acceleration)
        allowed = longest_lateness(nod) * cruise + _STEADY
        return abs(pitch - sample.pitch) <= allowed

    def _state(self, nod: Nod, time_ns: int) -> tuple[float, float]:
        """Return pitch [rad] and velocity [rad/s] of the nod with its reversals."""
        return _at(
            leg(nod, math.floor(nod.sweep_at(time_ns)), self._dynamics.acceleration), time_ns
        )

    def _continues(self, nod: Nod, now_ns: int) -> bool:
        """Return whether a nod continues the plan, but for what tuning changes."""
        if not self._plan or not self._plan[0].time_ns <= now_ns <= self._plan[-1].time_ns:
            return False
        (pitch, velocity), (was, went) = self._state(nod, now_ns), _at(self._plan, now_ns)
        led = FASTEST_LEAD * (now_ns - self._planned_ns) / NS_PER_S
        faster = _SMOOTH * nod.speed + led * self._dynamics.acceleration
        return abs(pitch - was) <= _STEADY + led * nod.speed and abs(velocity - went) <= faster

    def _leads_to(self, nod: Nod) -> bool:
        """Return whether the approach in the plan ends at a reversal of a nod."""
        number = round(nod.sweep_at(self._joins_ns))
        late = abs(self._joins_ns - nod.reversal_time_ns(number)) / NS_PER_S
        goal = self._plan[1]
        return goal.pitch == _limit(nod, number) and late <= _RETIMED * nod.sweep_duration

    def _first_reached(self, rest: Waypoint, nod: Nod) -> int:
        """Return the number of the first reversal that a joint at rest reaches in time."""
        return min(self._first_at(parity, rest, nod) for parity in (0, 1))

    def _first_at(self, parity: int, rest: Waypoint, nod: Nod) -> int:
        """Return the first reversal that is reached at the lower (0) or the upper (1) limit."""
        duration = self._shortest(abs(_limit(nod, parity) - rest.pitch), nod)
        reached_ns = rest.time_ns + round(duration * NS_PER_S) + _ROUNDING_NS
        number = math.ceil(nod.sweep_at(reached_ns))
        return number + (number - parity) % 2

    def _shortest(self, way: float, nod: Nod) -> float:
        """Return the time [s] of a cubic from rest to rest within the limits of the joint."""
        fastest = min(CATCH_UP * nod.speed, self._dynamics.max_speed)
        return _cubic_duration(way, fastest, self._dynamics.acceleration)

    def _legs(
        self, nod: Nod, first: int, now_ns: int, after: tuple[Nod, int] | None
    ) -> list[Waypoint]:
        """Return the legs from the first one to the end of the horizon, also of the nod after."""
        end_ns = now_ns + round(HORIZON * NS_PER_S)
        legs = [(nod, number) for number in _numbers(nod, first, end_ns)]
        if after is not None:
            other, start_ns = after
            until, begin = round(nod.sweep_at(start_ns)), round(other.sweep_at(start_ns))
            at_ns = other.reversal_time_ns(begin)
            same = abs(nod.reversal_time_ns(until) - at_ns) <= _SAME_NS
            same = same and _limit(nod, until) == _limit(other, begin)
            # Elsewhere than at a limit of both, the plan changes when the nod does.
            if same and first <= until <= legs[-1][1] + 1:
                legs = [each for each in legs if each[1] < until]
                legs += [(other, number) for number in _numbers(other, begin, end_ns)]
        points = [leg(*each, self._dynamics.acceleration) for each in legs]
        all_points = [*(point for part in points for point in part[:-1]), points[-1][-1]]
        # The nod after may begin before the last braking, if that is short.
        later = [one for one, two in pairwise(all_points) if one.time_ns < two.time_ns]
        return [*later, all_points[-1]]


def _is_new(sample: Measured, now_ns: int) -> bool:
    """Return whether a measurement tells where the joint is at a time [ns].

    An older one, or one that is ahead by more, does so only of a joint that hardly moves: at 6
    rad/s, a stamp that is wrong by 0.3 s is 1.8 rad.
    """
    age = abs(now_ns - sample.stamp_ns) / NS_PER_S
    return age <= _NEW or age * abs(sample.velocity) <= _STEADY


def _coasted(sample: Measured, now_ns: int) -> float:
    """Return the pitch [rad] at a time [ns] of a joint that goes on as measured."""
    return sample.pitch + sample.velocity * (now_ns - sample.stamp_ns) / NS_PER_S


def _within(pitch: float, limits: tuple[float, float]) -> float:
    return min(max(pitch, limits[0]), limits[1])


def _cubic_duration(way: float, fastest: float, acceleration: float) -> float:
    """Return the shortest time [s] of a cubic from rest to rest."""
    return max(1.5 * way / fastest, math.sqrt(6.0 * way / acceleration))


def _at(waypoints: Sequence[Waypoint], time_ns: int) -> tuple[float, float]:
    """Return pitch [rad] and velocity [rad/s] at a time [ns] within waypoints."""
    times = [(each.time_ns - time_ns) / NS_PER_S for each in waypoints]
    pitches, velocities = zip(*((each.pitch, each.velocity) for each in waypoints), strict=True)
    spline = CubicHermiteSpline(times, pitches, velocities)
    return float(spline(0.0)), float(spline(0.0, 1))


def _limit(nod: Nod, reversal: int) -> float:
    return nod.pitch_min if reversal % 2 == 0 else nod.pitch_max


def _numbers(nod: Nod, first: int, end_ns: int) -> range:
    """Return the numbers of the legs from the first one on, at least that, to a time [ns]."""
    return range(first, max(math.ceil(nod.sweep_at(end_ns)), first + 1))
