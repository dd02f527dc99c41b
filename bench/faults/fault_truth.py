"""The devices of a sensor under faults, and what they truly did."""

from dataclasses import dataclass, field

from nodlidar_common.arrays import Array, Integers, Times
from nodlidar_sim.devices.scip_models import URG_04LX_UG01
from nodlidar_sim.devices.urg_scan import Revolution
from nodlidar_sim.world.nod_motion import Motion


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
    codes: Integers
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
