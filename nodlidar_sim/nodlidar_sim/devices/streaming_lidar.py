"""An LD19 at byte level: it sends without being asked, and takes no commands."""

import math

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.ldrobot import (
    BIT_RATE,
    checksums,
    HEADER,
    PACKET,
    POINT_RATE,
    POINTS,
    RANGE_MM,
    ROTATION_RATE,
    TIMER_MS,
)
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.devices.wire import BITS_PER_BYTE
from nodlidar_sim.world.effects import Measure
from nodlidar_sim.world.sensor_model import instants
import numpy as np

_SPEED = 360.0 * ROTATION_RATE  # degrees per second
_SPEED_SCATTER, _SPEED_MEMORY = 0.005, 0.3  # a share, and s in which the motor corrects it
_TOGETHER = 4  # packets that its USB adapter hands on at once
_LINE_NS = round(PACKET.itemsize * BITS_PER_BYTE / BIT_RATE * NS_PER_S)
_CONFIDENCE = 200


class StreamingLidar:
    """The lidar as its host sees it; a `Device`.

    Parameters
    ----------
    measure
        As that of UrgEmulator. Called when packets reach the host.
    start_ns
        Host time of power-up [ns].
    clock_rate
        Seconds of its clock, which paces beams and timer, in a second of the host.
    seed
        Of its speed, and of where timer and rotation begin.
    """

    def __init__(
        self, measure: Measure, *, start_ns: int, clock_rate: float = 1.0, seed: int = 0
    ) -> None:
        self._measure, self._start_ns, self._clock_rate = measure, start_ns, clock_rate
        self._rng = np.random.default_rng(seed)
        self._angle, self._timer_ms = self._rng.uniform(0.0, 360.0), self._rng.integers(TIMER_MS)
        self._speed, self._sent = _SPEED, 0
        self._times_ns = self._beams_ns()

    def receive(self, data: bytes, now_ns: int) -> None:
        """Ignore what the host sends."""

    def transmit(self, now_ns: int) -> bytes:
        """Return the packets that have reached the host by a time [ns]."""
        arrived = b''
        while self.next_event_ns() <= now_ns:
            arrived += self._packets()
        return arrived

    def next_event_ns(self) -> int:
        """Return when the next packets reach the host [ns]."""
        return int(self._times_ns[-1, -1]) + _LINE_NS

    def _beams_ns(self) -> Integers:
        """Return when the beams of the next packets are measured [ns], shape (n, POINTS)."""
        beams = self._sent * POINTS + np.arange(_TOGETHER * POINTS).reshape(-1, POINTS)
        return instants(self._start_ns, beams / (POINT_RATE * self._clock_rate))

    def _packets(self) -> bytes:
        """Return the next packets, and turn on."""
        times_ns = self._times_ns
        speeds, angles = self._turn()
        ranges = self._measure(times_ns.ravel(), -np.radians(angles).ravel())
        packets = np.zeros(_TOGETHER, PACKET)
        packets['header'] = HEADER
        packets['speed'] = np.rint(speeds)
        packets['start_angle'] = np.rint(angles[:, 0] * 100.0) % 36_000
        packets['end_angle'] = np.rint(angles[:, -1] * 100.0) % 36_000
        millimetres = np.rint(np.nan_to_num(ranges * 1e3, posinf=0.0)).reshape(-1, POINTS)
        seen = (millimetres >= RANGE_MM[0]) & (millimetres <= RANGE_MM[1])
        packets['points']['distance'] = np.where(seen, millimetres, 0.0)
        packets['points']['confidence'] = np.where(seen, _CONFIDENCE, 0)
        elapsed_ms = (times_ns[:, -1] - self._start_ns) * (self._clock_rate * 1e3 / NS_PER_S)
        packets['timer'] = np.floor(self._timer_ms + elapsed_ms) % TIMER_MS
        packets['checksum'] = checksums(packets.view(np.uint8).reshape(_TOGETHER, -1))
        self._sent += _TOGETHER
        self._times_ns = self._beams_ns()
        return packets.tobytes()

    def _turn(self) -> tuple[Array, Array]:
        """Turn on; return speed [degrees/s] and beams [degrees] of packets, (n,), (n, POINTS)."""
        period = POINTS / POINT_RATE
        kept = math.exp(-period / _SPEED_MEMORY)
        scatter = _SPEED * _SPEED_SCATTER * math.sqrt(1.0 - kept**2)
        speeds, begins = np.empty(_TOGETHER), np.empty(_TOGETHER)
        for i, random in enumerate(self._rng.normal(0.0, scatter, _TOGETHER)):
            speeds[i], begins[i] = self._speed, self._angle
            self._angle = (self._angle + period * self._speed) % 360.0
            self._speed = _SPEED + (self._speed - _SPEED) * kept + random
        return speeds, begins[:, None] + np.arange(POINTS) / POINT_RATE * speeds[:, None]
