"""A Hokuyo URG-04LX-UG01 at byte level: SCIP 2.0 in the rhythm of its own rotation.

Every command is answered at the end of the turn during which it came, as a recording of a real
sensor shows, and a scan is sent at the end of the turn that measured it.
"""

from collections.abc import Callable
import re

from nodlidar_sim.devices.urg_clock import UrgClock
from nodlidar_sim.devices.urg_scan import Turn
from nodlidar_sim.devices.urg_sensor import MAX_LINE, UrgSensor
from nodlidar_sim.devices.wire import BITS_PER_BYTE, Wire
from nodlidar_sim.world.effects import Measure

_USB_BYTES_PER_SECOND = 2137 / 2.3e-3  # a whole scan in 2.3 ms, recorded
_USB_PIECE = 512
_UART_PIECE = 16
_CLASSIC_BIT_RATE = 19200
_MAX_PENDING = 8
_TERMINATOR = re.compile(rb'[\r\n]+')


class UrgEmulator:
    """The sensor as its host sees it; a `Device`.

    Parameters
    ----------
    measure
        Gives the ranges [m] of beams from their times [ns] and azimuths [rad]: inf where nothing
        is, NaN where a beam is lost. It is called once a turn, when the last beam has been sent.
    start_ns
        Host time at which it is switched on [ns].
    clock_rate
        Seconds of its clock, which paces timer and motor, in a second of the host.
    timer
        What its timer shows at the start [ms].
    rotation_phase
        The part of a turn that is over at the start, in [0, 1).
    bit_rate
        Of an RS-232 port, until SS changes it [bit/s]; None for USB.
    scip11
        Start in SCIP 1.1, as a classic URG-04LX does.
    serial_number
        As VV tells it.

    Attributes
    ----------
    sensor
        Its state; tests make it fail there.
    lost_commands
        Commands that came while eight others were waiting for the end of the turn.
    on_scan
        Told of each turn of a stream right before it is sent: its truth can be noted, its timer
        spoilt.
    """

    def __init__(
        self,
        measure: Measure,
        *,
        start_ns: int,
        clock_rate: float = 1.0,
        timer: float = 0.0,
        rotation_phase: float = 0.0,
        bit_rate: int | None = None,
        scip11: bool = False,
        serial_number: str = 'H0000001',
    ) -> None:
        self.lost_commands = 0
        self.on_scan: Callable[[Turn], None] = lambda turn: None
        self._measure = measure
        self._clock = UrgClock(start_ns, clock_rate, timer, rotation_phase)
        self.sensor = UrgSensor(self._clock, serial_number, bit_rate or _CLASSIC_BIT_RATE, scip11)
        self._usb = bit_rate is None
        self._wire = Wire(_USB_BYTES_PER_SECOND, _USB_PIECE if self._usb else _UART_PIECE)
        self._set_wire_speed()
        self._line = b''
        self._pending: list[bytes] = []

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the host; a line is ended by LF, CR or both."""
        self._advance(now_ns)
        *lines, rest = _TERMINATOR.split(self._line + data)
        self._line = rest[:MAX_LINE]
        for line in filter(None, lines):
            if len(self._pending) < _MAX_PENDING:
                self._pending.append(line[:MAX_LINE])
            else:
                self.lost_commands += 1

    def transmit(self, now_ns: int) -> bytes:
        """Return the bytes that have reached the host by now [ns]."""
        self._advance(now_ns)
        return self._wire.take(now_ns)

    def next_event_ns(self) -> int | None:
        """Return when the next bytes arrive, beams are measured or a turn ends that matters."""
        events = [self._wire.next_event_ns()]
        if self._busy():
            events.append(self._clock.turn.end_ns)
        if self._measuring():
            events.append(self._clock.turn.last_beam_ns)
        return min((event for event in events if event is not None), default=None)

    def _advance(self, now_ns: int) -> None:
        while self._busy():
            turn = self._clock.turn
            if self._measuring() and turn.last_beam_ns <= now_ns:
                turn.measure(self._measure)
            if turn.end_ns > now_ns:
                return
            self._finish_turn()
        self._clock.skip_to(now_ns)

    def _busy(self) -> bool:
        """Tell whether the end of this turn brings anything."""
        return bool(self._pending) or self.sensor.stream is not None

    def _measuring(self) -> bool:
        """Tell whether this turn's beams will be sent, and are still to be measured."""
        asked = any(line.startswith((b'GD', b'GS')) for line in self._pending)
        wanted = asked or self.sensor.measures()
        return wanted and self.sensor.laser and not self._clock.turn.measured

    def _finish_turn(self) -> None:
        turn, stream = self._clock.turn, self.sensor.stream
        late = self._wire.busy(turn.end_ns)  # a slow port: this scan is skipped
        types = [line[:2] for line in self._pending]
        for i, line in enumerate(self._pending):
            answer = self.sensor.execute(line, turn, repeated=types[i] in types[:i])
            self._wire.send(answer, turn.end_ns)
        self._pending.clear()
        self._set_wire_speed()
        if stream is not None and self.sensor.stream is stream and not late:
            if self.sensor.measures():
                self.on_scan(turn)
            self._wire.send(self.sensor.scan_message(turn), turn.end_ns)
        self._clock.next_turn()

    def _set_wire_speed(self) -> None:
        if not self._usb:
            self._wire.bytes_per_second = self.sensor.settings.bit_rate / BITS_PER_BYTE
