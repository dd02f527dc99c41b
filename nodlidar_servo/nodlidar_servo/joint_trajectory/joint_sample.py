"""Measurements of a joint that ros2_control moves."""

from dataclasses import dataclass

from nodlidar_common.dynamics import Dynamics
from nodlidar_common.stamps import NS_PER_S
from nodlidar_servo.nod.reach import ReachCheck, ReachError

LEAST_TO_DIFFER = 3
"""So many wrong stamps in a row show that it is the clock that is wrong."""

_MOST_LATE = 0.05  # s, that a joint state is on its way, or a cycle is late
_FARTHEST = 100.0  # rad; no joint that nods is farther
_SLACK = 0.05  # rad; of positions whose stamps jitter by milliseconds
_LEAST_STRENGTH = 50.0  # rad/s^2, that any joint may have


@dataclass(frozen=True, slots=True)
class JointSample:
    """Pitch [rad] and velocity [rad/s] of the joint at a time [ns]."""

    stamp_ns: int
    pitch: float
    velocity: float


class JointSampleFilter:
    """Takes measurements of a joint, each later than the one before.

    What a joint cannot have is refused, as a stray message of another publisher: a position that
    it cannot have reached, until it has lasted (0.2 s, if it is 3 rad away); or none.

    Parameters
    ----------
    dynamics
        What the joint can do.

    Attributes
    ----------
    latest
        The latest measurement; None without one.
    refused
        How many were refused for their positions.
    """

    def __init__(self, dynamics: Dynamics) -> None:
        # The joint may be stronger, or be turned by hand: a low acceleration is no bound.
        strongest = max(dynamics.acceleration, _LEAST_STRENGTH)
        self._reach = ReachCheck(strongest, dynamics.max_speed, _SLACK)
        self.latest: JointSample | None = None
        self.refused = 0

    def restart(self) -> None:
        """Forget the latest measurement: the joint may be anywhere by now."""
        self._reach.restart()
        self.latest = None

    def add(self, stamp_ns: int, pitch: float, velocity: float) -> JointSample | None:
        """Add and return a measurement; None if it is refused, or not later than the one before.

        A velocity that is missing, NaN, or that no joint has, is that since the measurement
        before, or 0 without one.
        """
        if self.latest is not None and stamp_ns <= self.latest.stamp_ns:
            return None
        try:
            if not abs(pitch) <= _FARTHEST:
                raise ReachError(f'no position up to {_FARTHEST} rad: {pitch}')
            self._reach.accept(stamp_ns, pitch)
        except ReachError:
            self.refused += 1
            return None
        if not abs(velocity) <= self._reach.fastest:  # not every hardware measures it
            velocity = self._reach.velocity
        self.latest = JointSample(stamp_ns, pitch, velocity)
        return self.latest


class JointStamps:
    """Refuses joint states without a stamp, or that are stamped long before or after they arrive.

    Parameters
    ----------
    longest
        Longest time between stamp and arrival [s].

    Attributes
    ----------
    refused
        How many were refused.
    trouble
        What is wrong with the stamps, after LEAST_TO_DIFFER in a row; empty if they are good.
    """

    def __init__(self, longest: float) -> None:
        self._longest = longest
        self._in_a_row = 0
        self._words: dict[bool, str] = {}  # since the last good stamp, by whether there is a stamp
        self.refused, self.trouble = 0, ''

    def restart(self) -> None:
        """Judge anew: clocks may agree again. Until they do, the words stay the same."""
        self._in_a_row, self.trouble = 0, ''

    def believe(self, stamp_ns: int, now_ns: int) -> bool:
        """Return whether a stamp [ns] is believed, at a time [ns]."""
        late = (now_ns - stamp_ns) / NS_PER_S
        if stamp_ns and abs(late) <= self._longest:
            self._in_a_row, self.trouble = 0, ''
            self._words.clear()
            return True
        self.refused += 1
        self._in_a_row += 1
        if self._in_a_row >= LEAST_TO_DIFFER:
            words = (
                f'are stamped {late:.3f} s before they arrive: the clocks of this node and of the '
                'controller manager differ; synchronise them, or set use_sim_time alike'
                if stamp_ns
                else 'have no stamp: their publisher must say when the joint was measured'
            )
            self.trouble = self._words.setdefault(bool(stamp_ns), words)
        return False


class StampError:
    """Tells that stamps are wrong: clouds are wrong by as much.

    A joint state that arrived since the last cycle is at most so old, if its stamp is right; or
    as old as its arrival, where the middleware tells that.

    Attributes
    ----------
    seconds
        By how much the latest stamps were too early, at least, or too late if it is negative; 0
        unless LEAST_TO_DIFFER in a row were wrong by more than 0.05 s.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self._in_a_row = 0

    def add(self, age: float, since: float) -> None:
        """Add the age [s] of the newest joint state of a cycle; it came so long ago at most."""
        error = max(age - since, 0.0) + min(age, 0.0)
        self._in_a_row = self._in_a_row + 1 if abs(error) > _MOST_LATE else 0
        self.seconds = error if self._in_a_row >= LEAST_TO_DIFFER else 0.0
