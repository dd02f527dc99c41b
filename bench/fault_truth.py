"""The devices of a sensor under faults, and what they really did."""

from dataclasses import dataclass, field

from nodlidar_sim.devices.urg_scan import FIRST_STEP, LAST_STEP, MIN_RANGE_MM, Turn
from nodlidar_sim.world.motion import Array, Motion, Times
from nodlidar_sim.world.servo_motion import ServoMotion
import numpy as np
from numpy.typing import NDArray

SAMPLING_NS = 1_000_000  # of the true pitch; at 200 rad/s^2 a line is 25 urad off in between
_REMEMBERED_NS = 4_000_000_000  # that a servo's motion surely tells


@dataclass(frozen=True, slots=True, eq=False)
class TrueScan:
    """A turn of the lidar that was sent.

    Attributes
    ----------
    times_ns, codes, pitch
        Of each beam: when it was sent [ns], what it measured [mm] (0: nothing), and where it
        pointed [rad], shape (682,).
    heard
        Whether the host that has asked for it still had the lidar's port open.
    """

    times_ns: Times
    codes: NDArray[np.int64]
    pitch: Array
    heard: bool


@dataclass(slots=True)
class Changes:
    """When something was switched on or off [ns]."""

    times_ns: list[int] = field(default_factory=list)
    states: list[bool] = field(default_factory=list)

    def note(self, now_ns: int, state: bool) -> None:
        """Take note of a state."""
        if not self.states or self.states[-1] != state:
            self.times_ns.append(now_ns)
            self.states.append(state)

    def off_after(self, since_ns: int, until_ns: int) -> float:
        """Return the seconds from a time [ns] until it is off; infinite if not before an end."""
        before = [on for t, on in zip(self.times_ns, self.states, strict=True) if t <= since_ns]
        if not before or not before[-1]:
            return 0.0
        for time_ns, state in zip(self.times_ns, self.states, strict=True):
            if since_ns < time_ns <= until_ns and not state:
                return (time_ns - since_ns) / 1e9
        return float('inf')


class Truth:
    """What really happened; the thread that serves the devices fills it.

    Attributes
    ----------
    scans
        All that the lidar sent.
    torque, laser
        When they were on.
    """

    def __init__(self, shaft: Motion, start_ns: int) -> None:
        self.scans: list[TrueScan] = []
        self.torque, self.laser = Changes(), Changes()
        self._shaft = shaft
        self._next_ns = start_ns
        self._times_ns: list[Times] = []
        self._pitch: list[Array] = []

    def add_scan(self, turn: Turn, heard: bool) -> None:
        """Take note of a turn that is sent."""
        codes = turn.codes[FIRST_STEP : LAST_STEP + 1].copy()
        codes[codes < MIN_RANGE_MM] = 0
        pitch = self._shaft.position(turn.times_ns)
        self.scans.append(TrueScan(turn.times_ns, codes, pitch, heard))

    def follow(self, now_ns: int) -> None:
        """Take note of the pitch up to now [ns]."""
        self._next_ns = max(self._next_ns, now_ns - _REMEMBERED_NS)
        times_ns = np.arange(self._next_ns, now_ns, SAMPLING_NS)
        if times_ns.size:
            self._times_ns.append(times_ns)
            self._pitch.append(self._shaft.position(times_ns))
            self._next_ns = int(times_ns[-1]) + SAMPLING_NS

    def pitch(self, times_ns: Times) -> Array:
        """Return the pitch [rad] at times [ns] within what was followed."""
        known = np.concatenate(self._times_ns)
        elapsed = (times_ns - known[0]) / 1e9
        pitch: Array = np.interp(elapsed, (known - known[0]) / 1e9, np.concatenate(self._pitch))
        return pitch


class FaultyServo(ServoMotion):
    """A shaft as its motor drives it and its encoder tells it.

    Attributes
    ----------
    shaft
        The truth.
    blocked
        The motor cannot move it.
    frozen
        The encoder tells this [rad]; None to tell where the shaft is.
    spike_rate
        Share of the readings that are anywhere.
    first_hit_ns
        When any of that first mattered [ns]; None if it never did.
    """

    def __init__(self, shaft: ServoMotion, seed: int) -> None:
        super().__init__()
        self.shaft = shaft
        self._rng = np.random.default_rng(seed)
        self.mend()

    def mend(self) -> None:
        """Be sound from now on."""
        self.blocked = False
        self.frozen: float | None = None
        self.spike_rate = 0.0
        self.first_hit_ns: int | None = None

    def position(self, times_ns: Times) -> Array:
        """Return what the encoder tells [rad]."""
        if self.frozen is not None:
            self._hit(times_ns)
            return np.full(np.shape(times_ns), self.frozen)
        if self.spike_rate and self._rng.random() < self.spike_rate:
            self._hit(times_ns)
            return np.full(np.shape(times_ns), self._rng.uniform(-2.6, 2.6))
        return self.shaft.position(times_ns)

    def velocity(self, times_ns: Times) -> Array:
        """Return what the speed register tells [rad/s]."""
        return self.shaft.velocity(times_ns) * (self.frozen is None)

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Go to an angle [rad] at a speed [rad/s], unless it is blocked."""
        if self.blocked:
            self._hit(np.array([now_ns]))
            self.shaft.brake(now_ns)
        else:
            self.shaft.set_goal(now_ns, goal, speed_limit)

    def brake(self, now_ns: int) -> None:
        """Come to rest."""
        self.shaft.brake(now_ns)

    def _hit(self, times_ns: Times) -> None:
        if self.first_hit_ns is None:
            self.first_hit_ns = int(times_ns[0])
