"""The commands of SCIP 2.0 that an emulated URG-04LX executes, and its answers.

Section numbers are those of Hokuyo's specification C-42-03320B.
"""

from collections.abc import Callable
from dataclasses import dataclass

from nodlidar_common import scip
from nodlidar_sim.devices.urg_clock import UrgClock
from nodlidar_sim.devices.urg_faults import UrgFaults
from nodlidar_sim.devices.urg_identity import (
    parameter_lines,
    status_lines,
    version_lines,
)
from nodlidar_sim.devices.urg_requests import (
    check_line,
    CommandError,
    message,
    number,
    scan_request,
    size_status,
    Stream,
)
from nodlidar_sim.devices.urg_scan import Revolution
from nodlidar_sim.devices.urg_settings import UrgSettings

_OPEN_IN_FIRMWARE_UPDATE = (b'VV', b'II', b'RS')


@dataclass(frozen=True, slots=True)
class Command:
    """A command: its whole line, the characters of its parameters, and when it is executed.

    It is executed at the end of the revolution.
    """

    line: bytes
    parameters: bytes
    revolution: Revolution


class UrgSensor:
    """The state of the sensor, as changed by commands; the caller does the timing.

    Parameters
    ----------
    clock
        Its timer and motor.
    scip11
        Power up in SCIP 1.1, of which only V and SCIP2.0 are emulated.

    Attributes
    ----------
    laser
        Whether it is on.
    settings
        Bit rate, motor speed, sensitivity.
    stream
        The running MD or MS, if any.
    faults
        Faults that tests inject.
    firmware_update
        Set it to get 0I for most commands, until a reset.
    """

    def __init__(self, clock: UrgClock, scip11: bool) -> None:
        self.laser = False
        self.stream: Stream | None = None
        self.settings = UrgSettings(clock)
        self.faults = UrgFaults()
        self.firmware_update = False
        self._clock = clock
        self._scip2 = not scip11
        self._time_mode = False
        self._error: bytes | None = None

    def refuse_next(self, status: bytes) -> None:
        """Answer the next command with an error status."""
        self._error = status

    def execute(self, line: bytes, revolution: Revolution, repeated: bool = False) -> bytes:
        """Execute a command at the end of a revolution and return the answer.

        Of commands of one type within a revolution, only the first is executed (section 8).
        """
        if not self._scip2:
            return self._answer_in_scip11(line)
        if repeated:
            return message(line, b'0B')
        before = self.stream
        try:
            lines = self._answer(line, revolution)
        except CommandError as error:
            return message(line, error.status)
        if self.stream is before:
            self.stream = None  # every command that is executed ends a stream
        return message(line, b'00', lines)

    def measures(self) -> bool:
        """Return whether the stream will send the current revolution."""
        return self.stream is not None and self.stream.wait == 0

    def scan_message(self, revolution: Revolution) -> bytes:
        """Return the stream's message at the end of a revolution, empty if it skips this one."""
        stream = self.stream
        if stream is None:
            return b''
        if stream.wait:
            stream.wait -= 1
            return b''
        status = self.faults.next_status()
        if status is not None:
            if self.faults.malfunction:
                self._stop()
            return message(stream.echo(), b'%02d' % status)
        stream.advance()
        if stream.remaining == 0:
            self._stop()  # section 8.1
        return message(stream.echo(), b'99', stream.request.lines(revolution))

    def _stop(self) -> None:
        self.laser, self.stream = False, None

    def _answer_in_scip11(self, line: bytes) -> bytes:
        """Answer V or SCIP2.0; answers of SCIP 1.1 have no checksums."""
        self._scip2 = line == b'SCIP2.0'
        lines = [text[:-2] for text in version_lines(self._clock.model)] if line == b'V' else []
        status = b'0' if self._scip2 or lines else b'E'
        return b'\n'.join([line, status, *lines]) + b'\n\n'

    def _answer(self, line: bytes, revolution: Revolution) -> list[bytes]:
        """Execute a command and return the lines of the answer; raises CommandError."""
        error, self._error = self._error, None
        if error:
            raise CommandError(error)
        body, _, text = line.partition(b';')
        check_line(line, text)
        letters, parameters = body[:2], body[2:]
        if letters not in _COMMANDS:
            raise CommandError(b'0D' if len(body) < 2 else b'0E')
        if self.firmware_update and letters not in _OPEN_IN_FIRMWARE_UPDATE:
            raise CommandError(b'0I')
        if self._time_mode and letters != b'TM':
            raise CommandError(b'0E')
        size, action = _COMMANDS[letters]
        if len(parameters) != size:
            raise CommandError(size_status(len(parameters), size))
        return action(self, Command(line, parameters, revolution))

    # The commands (section 8): each returns the lines of its answer or raises CommandError.

    def _version(self, command: Command) -> list[bytes]:
        return version_lines(self._clock.model)

    def _parameters(self, command: Command) -> list[bytes]:
        return parameter_lines(self._clock.model)

    def _status(self, command: Command) -> list[bytes]:
        malfunction = self.faults.malfunction
        status = f'Malfunction {malfunction}' if malfunction else 'Sensor works well.'
        if self.firmware_update:
            status = 'F/W update mode'
        return status_lines(
            self._clock.model,
            self.laser,
            self.stream is not None,
            self._clock.speed,
            f'{self.settings.bit_rate}[bps]',
            self._clock.timer(command.revolution.end_ns),
            status,
        )

    def _laser_on(self, command: Command) -> list[bytes]:
        if self.faults.malfunction:
            raise CommandError(b'01')
        if self.laser:
            raise CommandError(b'02')
        self.laser = True
        return []

    def _quit(self, command: Command) -> list[bytes]:
        self._stop()
        return []

    def _reset(self, command: Command) -> list[bytes]:
        self.settings.reset()
        return self._partial_reset(command)

    def _partial_reset(self, command: Command) -> list[bytes]:
        self._clock.reset_timer(command.revolution.end_ns)
        self.firmware_update = self.settings.high_sensitivity = False
        self.faults.clear()
        return self._quit(command)

    def _time(self, command: Command) -> list[bytes]:
        if command.parameters == b'1':
            if not self._time_mode:
                raise CommandError(b'04')
            return [scip.add_sum(scip.encode([self._clock.timer(command.revolution.end_ns)], 4))]
        if command.parameters not in (b'0', b'2'):
            raise CommandError(b'01')
        enter = command.parameters == b'0'
        if enter == self._time_mode:
            raise CommandError(b'02' if enter else b'03')
        self._time_mode = enter
        self._stop()
        return []

    def _stream_scans(self, command: Command) -> list[bytes]:
        line, parameters = command.line, command.parameters
        request = scan_request(line, parameters, self._clock.model.last_requestable)
        interval = number(parameters[10:11], b'06')
        count = number(parameters[11:13], b'07')
        self._check_sound()
        self.laser = True
        self.stream = Stream(request, line[:13], line[15:], interval, count or None)
        return []

    def _one_scan(self, command: Command) -> list[bytes]:
        last = self._clock.model.last_requestable
        request = scan_request(command.line, command.parameters, last)
        self._check_sound()
        if not self.laser:
            raise CommandError(b'10')
        return request.lines(command.revolution)

    def _check_sound(self) -> None:
        if self.faults.malfunction:
            raise CommandError(b'%02d' % self.faults.malfunction)

    def _set(self, command: Command) -> list[bytes]:
        self.settings.set(command.line[:2], command.parameters)
        return []


_Action = Callable[[UrgSensor, Command], list[bytes]]

_COMMANDS: dict[bytes, tuple[int, _Action]] = {  # number of parameter characters, action
    b'VV': (0, UrgSensor._version),
    b'PP': (0, UrgSensor._parameters),
    b'II': (0, UrgSensor._status),
    b'BM': (0, UrgSensor._laser_on),
    b'QT': (0, UrgSensor._quit),
    b'RS': (0, UrgSensor._reset),
    b'RT': (0, UrgSensor._partial_reset),
    b'TM': (1, UrgSensor._time),
    b'MD': (13, UrgSensor._stream_scans),
    b'MS': (13, UrgSensor._stream_scans),
    b'GD': (10, UrgSensor._one_scan),
    b'GS': (10, UrgSensor._one_scan),
    b'SS': (6, UrgSensor._set),
    b'CR': (2, UrgSensor._set),
    b'HS': (1, UrgSensor._set),
}
