"""The nod of a servo by physics in the fast mode, commanded as the servo node does it."""

from __future__ import annotations

from dataclasses import dataclass
import math

from nodlidar_common.dynamics import Dynamics
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import Drive, NodTracker
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np

SETTLING = 10.0
"""Time before the recording in which the servo gets on the nod and its lead is learned [s]."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What the servo node measures: pitch [rad] and velocity [rad/s] at a time [ns]."""

    stamp_ns: int
    pitch: float
    velocity: float


def nodding_servo(
    parameters: ServoParameters,
    nod: Nod,
    sensor: SensorModel,
    start_ns: int,
    end_ns: int,
    seed: int = 0,
) -> PhysicalServo:
    """Return a servo that follows a nod from start_ns to end_ns.

    The commands are those of the node of nodlidar_servo, NodTracker: one in each cycle at the
    sensor's joint rate, from a reading that is as old as the adapter's latency, and one at each
    reversal. Goals are whole ticks, speeds whole counts of the speed register.

    Parameters
    ----------
    parameters
        Of the servo.
    nod
        The commanded nod.
    sensor
        Its joint rate, the adapter's latency, and the acceleration that the node counts on.
    start_ns, end_ns
        First and last instant of the recording [ns].
    seed
        Of the encoder's errors.
    """
    begin_ns = start_ns - round(SETTLING * NS_PER_S)
    servo = PhysicalServo(parameters, float(nod.pitch(begin_ns)), seed, history=math.inf)
    node = _Node(servo, nod, sensor)
    cycles = math.ceil((end_ns - begin_ns) / NS_PER_S * sensor.joint_rate)
    deadlines = start_ns + np.rint(
        (np.arange(cycles + 1) / sensor.joint_rate - SETTLING) * NS_PER_S
    ).astype(np.int64)
    for deadline_ns in deadlines.tolist():
        node.cycle(deadline_ns)
    return servo


class _Node:
    """The cycle of the servo node, without its bus: see ServoLoop of nodlidar_servo."""

    def __init__(self, servo: PhysicalServo, nod: Nod, sensor: SensorModel) -> None:
        p = servo.parameters
        fastest = min(p.no_load_speed, p.speed_counts * p.speed_unit)
        self._servo, self._tick, self._unit = servo, p.tick, p.speed_unit
        self._tracker = NodTracker(nod, Dynamics(sensor.acceleration, p.speed_unit, fastest))
        latency = min(sensor.joint_latency, 1.0 / sensor.joint_rate)  # the node waits for it
        self._latency_ns = round(latency * NS_PER_S)
        self._reading: Reading | None = None
        self._steered_ns = 0

    def cycle(self, deadline_ns: int) -> None:
        """Steer at a reversal that comes first, measure at a deadline [ns], and steer."""
        if self._reading is not None:
            reversal_ns = self._tracker.next_reversal_ns(self._steered_ns)
            if reversal_ns < deadline_ns:
                self._steer(self._reading, max(reversal_ns, self._steered_ns))
        self._reading = self._measured(deadline_ns)
        self._steer(self._reading, deadline_ns + self._latency_ns)

    def _measured(self, now_ns: int) -> Reading:
        pitch, speed = self._servo.measured(now_ns)
        return Reading(now_ns, pitch, round(speed / self._unit) * self._unit)

    def _steer(self, reading: Reading, now_ns: int) -> None:
        self._steered_ns = now_ns
        drive = self._tracker.step(now_ns, reading)
        self._servo.set_goal(now_ns, *self._rounded(drive))

    def _rounded(self, drive: Drive) -> tuple[float, float]:
        """Return goal and speed as the registers hold them; speed 0 would mean the highest."""
        counts = min(max(round(drive.speed / self._unit), 1), self._servo.parameters.speed_counts)
        return round(drive.goal / self._tick) * self._tick, counts * self._unit
