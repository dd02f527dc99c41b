"""A serial port as SCIP sees it: messages out, messages up to their empty line in."""

from collections.abc import Callable
from typing import Protocol

from nodlidar_common.errors import DeviceError, PortError
import serial

_END = b'\n\n'
_PATIENCE = 65_536  # bytes without a use, after which the sender is taken for no lidar
_SILENCE = 0.14  # [s] more than a rotation: nothing is coming any more


class SerialPort(Protocol):
    """What is used of pyserial's ``Serial``."""

    timeout: float | None

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""

    def read(self, size: int = 1, /) -> bytes:
        """Return that many bytes, or fewer after the timeout."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""


class ScipPort:
    """Sends commands and receives messages; every failure of the port is a PortError.

    Attributes
    ----------
    arrival_ns
        Host time [ns] at which the last bytes were read.
    """

    def __init__(self, port: SerialPort, clock: Callable[[], int], timeout: float) -> None:
        self.arrival_ns = 0
        self._port = port
        self._clock = clock
        self._timeout = timeout
        self._buffer = bytearray()
        self._useless = 0
        port.timeout = timeout

    def send(self, command: str) -> None:
        """Send a command and its line feed."""
        try:
            self._port.write(command.encode('ascii') + b'\n')
        except (serial.SerialException, OSError) as error:
            raise PortError(f'the serial port went away: {error}') from error

    def receive(self, expected: int = 1) -> bytes:
        """Return the next message without its empty line, waiting for it.

        Parameters
        ----------
        expected
            Length of the message [bytes], empty line included, as far as it is known: bytes are
            waited for together and not one by one.

        Raises
        ------
        DeviceError
            If nothing comes for the timeout, or a lot that nobody could use.
        PortError
            If the port fails.
        """
        while (end := self._buffer.find(_END)) < 0:
            self._fill(expected - len(self._buffer))
        message = bytes(self._buffer[:end])
        del self._buffer[: end + len(_END)]
        return message

    def useful(self) -> None:
        """Tell that the last message was of use, so that the sender speaks SCIP."""
        self._useless = 0

    def drain(self) -> None:
        """Discard what comes until nothing does; what streams on is given up after a while."""
        self._buffer.clear()
        for _ in range(4):
            self._port.timeout = _SILENCE
            silent = not self._read(_PATIENCE)
            self._port.timeout = self._timeout
            if silent:
                return

    def _fill(self, wanted: int) -> None:
        if self._useless > _PATIENCE:
            raise DeviceError(f'received {self._useless} bytes that are no SCIP 2.0; a lidar?')
        data = self._read(wanted)
        if not data:
            raise DeviceError(f'the lidar did not send anything for {self._timeout} s')
        self._buffer += data
        self._useless += len(data)

    def _read(self, wanted: int) -> bytes:
        try:
            data = self._port.read(max(wanted, self._port.in_waiting, 1))
        except (serial.SerialException, OSError) as error:
            raise PortError(f'the serial port went away: {error}') from error
        self.arrival_ns = self._clock()
        return data
