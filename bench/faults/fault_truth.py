"""The devices of a sensor under faults, and what they truly did."""

from dataclasses import dataclass, field

from nodlidar_sim.devices.scip_models import URG_04LX_UG01
from nodlidar_sim.devices.urg_scan import Revolution
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.nod_motion import Array, Motion, Times
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class TrueScan:
    """A scan that the lidar sent.

    Attributes
    ----------
    times_ns, codes, pitch
        Of each beam: when it was sent [ns], its range [mm] (0: none), and its pitch [rad],
        shape (682,).
    heard
        Whether the host that requested it still had the lidar's port open.
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
        """Record the state at a time [ns]."""
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
    """What truly happened; the thread that serves the devices fills it.

    Attributes
    ----------
    scans
        All scans that the lidar sent.
    torque, laser
        When they were on.
    """

    def __init__(self, motion: Motion) -> None:
        self.scans: list[TrueScan] = []
        self.torque, self.laser = Changes(), Changes()
        self._motion = motion

    def add_scan(self, revolution: Revolution, heard: bool) -> None:
        """Record a revolution that is sent."""
        codes = revolution.codes[URG_04LX_UG01.steps]
        codes[codes < URG_04LX_UG01.range_min_mm] = 0
        pitch = self._motion.position(revolution.times_ns)
        self.scans.append(TrueScan(revolution.times_ns, codes, pitch, heard))


class FaultyServo(IdealServo):
    """A servo whose motor and encoder can fail; its motion is the true one.

    Attributes
    ----------
    blocked
        Whether the motor cannot move it.
    frozen
        Reading of the encoder [rad]; None for the true position.
    spike_rate
        Share of the readings that are random.
    first_hit_ns
        When a fault first had an effect [ns]; None if none had.
    """

    def __init__(self, seed: int) -> None:
        super().__init__()
        self._rng = np.random.default_rng(seed)
        self.mend()

    def mend(self) -> None:
        """End all faults."""
        self.blocked = False
        self.frozen: float | None = None
        self.spike_rate = 0.0
        self.first_hit_ns: int | None = None

    def measured(self, now_ns: int) -> tuple[float, float]:
        """Return the readings of the encoder [rad] and of the speed register [rad/s]."""
        position, velocity = super().measured(now_ns)
        if self.frozen is not None:
            self._hit(now_ns)
            return self.frozen, 0.0
        if self.spike_rate and self._rng.random() < self.spike_rate:
            self._hit(now_ns)
            return self._rng.uniform(-2.6, 2.6), velocity
        return position, velocity

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Go to an angle [rad] at a speed [rad/s], unless it is blocked."""
        if self.blocked:
            self._hit(now_ns)
            self.brake(now_ns)
        else:
            super().set_goal(now_ns, goal, speed_limit)

    def _hit(self, now_ns: int) -> None:
        if self.first_hit_ns is None:
            self.first_hit_ns = now_ns
