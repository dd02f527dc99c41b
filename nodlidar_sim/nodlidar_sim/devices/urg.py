"""A Hokuyo lidar at byte level, by default a URG-04LX-UG01: SCIP 2.0, paced by its own rotation.

As in a recording of a real sensor, a command is answered at the end of the revolution in which it
arrived, and a scan is sent at the end of the revolution that measured it.
"""

from collections.abc import Callable
import re

from nodlidar_sim.devices.scip_models import ScipModel, URG_04LX_UG01
from nodlidar_sim.devices.urg_clock import UrgClock
from nodlidar_sim.devices.urg_requests import MAX_LINE
from nodlidar_sim.devices.urg_scan import Revolution
from nodlidar_sim.devices.urg_sensor import UrgSensor
from nodlidar_sim.devices.wire import Wire
from nodlidar_sim.world.effects import Measure

_USB_BYTES_PER_SECOND = 2137 / 2.3e-3  # a whole scan in 2.3 ms, recorded
_USB_PIECE = 512
_MAX_PENDING = 8
_TERMINATOR = re.compile(rb'[\r\n]+')


class UrgEmulator:
    """The sensor as its host sees it; a `Device`.

    Parameters
    ----------
    measure
        Returns the ranges [m] of beams at given times [ns] and azimuths [rad]: inf without a
        surface, NaN for a lost beam. Called once a revolution, at the time of its last beam.
    start_ns
        Host time of power-up [ns].
    clock_rate
        Seconds of its clock, which paces timer and motor, in a second of the host.
    timer
        Reading of its timer at power-up [ms].
    rotation_phase
        Fraction of a revolution that is over at power-up, in [0, 1).
    scip11
        Power up in SCIP 1.1, as a classic URG-04LX does.
    model
        What it reports, and how its beams lie.

    Attributes
    ----------
    sensor
        Its state; tests inject faults there.
    on_scan
        Called with each revolution of a stream just before it is sent; may record or change it.
    """

    def __init__(
        self,
        measure: Measure,
        *,
        start_ns: int,
        clock_rate: float = 1.0,
        timer: float = 0.0,
        rotation_phase: float = 0.0,
        scip11: bool = False,
        model: ScipModel = URG_04LX_UG01,
    ) -> None:
        self.on_scan: Callable[[Revolution], None] = lambda revolution: None
        self._measure = measure
        self._clock = UrgClock(start_ns, clock_rate, timer, rotation_phase, model)
        self.sensor = UrgSensor(self._clock, scip11)
        self._wire = Wire(_USB_BYTES_PER_SECOND, _USB_PIECE)
        self._line = b''
        self._pending: list[bytes] = []

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the host; LF, CR or both end a line."""
        self._advance(now_ns)
        *lines, rest = _TERMINATOR.split(self._line + data)
        self._line = rest[:MAX_LINE]
        for line in filter(None, lines):
            if len(self._pending) < _MAX_PENDING:
                self._pending.append(line[:MAX_LINE])

    def transmit(self, now_ns: int) -> bytes:
        """Remove and return the bytes that have reached the host by a time [ns]."""
        self._advance(now_ns)
        return self._wire.take(now_ns)

    def next_event_ns(self) -> int | None:
        """Return when bytes next arrive, beams are measured or a revolution ends [ns], or None."""
        events = [self._wire.next_event_ns()]
        if self._busy():
            events.append(self._clock.revolution.end_ns)
        if self._measuring():
            events.append(self._clock.revolution.last_beam_ns)
        return min((event for event in events if event is not None), default=None)

    def _advance(self, now_ns: int) -> None:
        while self._busy():
            revolution = self._clock.revolution
            if self._measuring() and revolution.last_beam_ns <= now_ns:
                revolution.measure(self._measure)
            if revolution.end_ns > now_ns:
                return
            self._finish_revolution()
        self._clock.skip_to(now_ns)

    def _busy(self) -> bool:
        """Return whether anything is sent at the end of this revolution."""
        return bool(self._pending) or self.sensor.stream is not None

    def _measuring(self) -> bool:
        """Return whether this revolution's beams will be sent and are not measured yet."""
        asked = any(line.startswith((b'GD', b'GS')) for line in self._pending)
        wanted = asked or self.sensor.measures()
        return wanted and self.sensor.laser and not self._clock.revolution.measured

    def _finish_revolution(self) -> None:
        revolution, stream = self._clock.revolution, self.sensor.stream
        types = [line[:2] for line in self._pending]
        for i, line in enumerate(self._pending):
            answer = self.sensor.execute(line, revolution, repeated=types[i] in types[:i])
            self._wire.send(answer, revolution.end_ns)
        self._pending.clear()
        if stream is not None and self.sensor.stream is stream:
            if self.sensor.measures():
                self.on_scan(revolution)
            self._wire.send(self.sensor.scan_message(revolution), revolution.end_ns)
        self._clock.next_revolution()
