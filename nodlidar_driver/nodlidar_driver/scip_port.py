"""A serial port as SCIP sees it: messages out, messages up to their empty line in."""

from collections.abc import Callable
import math
from typing import Protocol

from nodlidar_common.errors import DeviceError, StoppedError
from nodlidar_common.serial_port import port_errors

READ_TIMEOUT = 0.14
"""Longest wait of one read [s]: more than a revolution, so that after it nothing is coming."""

_END = b'\n\n'
_PATIENCE = 65_536  # bytes without a use, after which the sender is taken for no lidar


class SilenceError(DeviceError):
    """A lidar that does not send anything."""


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

    Parameters
    ----------
    port
        An open port.
    clock
        Returns the host time [ns].
    timeout
        How long the lidar may be silent [s].
    keep_going
        Asked before every read of a message: False ends the wait with a StoppedError.

    Attributes
    ----------
    arrival_ns
        Host time [ns] at which the last bytes were read.
    """

    def __init__(
        self,
        port: SerialPort,
        clock: Callable[[], int],
        timeout: float,
        keep_going: Callable[[], bool],
    ) -> None:
        self.arrival_ns = 0
        self._port = port
        self._clock = clock
        self._timeout = timeout
        self._keep_going = keep_going
        self._buffer = bytearray()
        self._useless = 0
        with port_errors():
            port.timeout = READ_TIMEOUT

    def send(self, command: str) -> None:
        """Send a command and its line feed."""
        self.write(command.encode('ascii') + b'\n')

    def write(self, data: bytes) -> None:
        """Send bytes."""
        with port_errors():
            self._port.write(data)

    def receive(self, expected: int = 1, timeout: float = math.inf) -> bytes:
        """Return the next message without its empty line, waiting for it.

        Parameters
        ----------
        expected
            Length of the message [bytes], empty line included, as far as it is known: bytes are
            waited for together and not one by one.
        timeout
            How long nothing may come [s], if that is less than usual.

        Raises
        ------
        SilenceError
            If nothing comes for the timeout.
        DeviceError
            If a lot comes that nobody could use.
        PortError
            If the port fails.
        StoppedError
            If `keep_going` says so.
        """
        while (end := self._buffer.find(_END)) < 0:
            self._fill(expected - len(self._buffer), min(timeout, self._timeout))
        message = bytes(self._buffer[:end])
        del self._buffer[: end + len(_END)]
        return message

    def useful(self) -> None:
        """Tell that the last message was of use, so that the sender speaks SCIP."""
        self._useless = 0

    def discard(self) -> None:
        """Forget what has arrived."""
        self._buffer.clear()
        with port_errors():
            for _ in range(4):
                self._port.read(self._port.in_waiting)

    def read_some(self) -> bytes:
        """Return the next bytes as soon as there are any, or none after READ_TIMEOUT."""
        return self._read(1)

    def _fill(self, wanted: int, timeout: float) -> None:
        if self._useless > _PATIENCE:
            raise DeviceError(f'received {self._useless} bytes that are no SCIP 2.0; a lidar?')
        data = self._wait(wanted, timeout)
        self._buffer += data
        self._useless += len(data)

    def _wait(self, wanted: int, timeout: float) -> bytes:
        """Return the next bytes; many short reads, so that a stop is soon noticed."""
        for _ in range(math.ceil(timeout / READ_TIMEOUT)):
            if not self._keep_going():
                raise StoppedError('stopped waiting for the lidar')
            if data := self._read(wanted):
                return data
        raise SilenceError(f'the lidar did not send anything for {timeout} s')

    def _read(self, wanted: int) -> bytes:
        with port_errors():
            data = self._port.read(max(wanted, self._port.in_waiting, 1))
        self.arrival_ns = self._clock()
        return data
