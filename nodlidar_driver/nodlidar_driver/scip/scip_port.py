"""A serial port for SCIP: sends commands, receives messages up to their empty line."""

from dataclasses import dataclass, field
import math

from nodlidar_common.errors import DeviceError
from nodlidar_common.serial_port import port_errors
from nodlidar_driver.base.reader import Reader

_END = b'\n\n'
_MOST_USELESS = 65_536  # bytes in a row that are not SCIP: the sender is not a lidar


@dataclass(slots=True)
class ScipPort(Reader):
    """Sends commands and receives messages."""

    _buffer: bytearray = field(default_factory=bytearray, init=False)
    _useless: int = field(default=0, init=False)

    def send(self, command: str) -> None:
        """Send a command and its line feed."""
        self.write(command.encode('ascii') + b'\n')

    def write(self, data: bytes) -> None:
        """Send bytes."""
        with port_errors():
            self.port.write(data)

    def receive(self, expected: int = 1, timeout: float = math.inf) -> bytes:
        """Wait for the next message and return it without its empty line.

        Parameters
        ----------
        expected
            Length of the message [bytes], empty line included, if known: then its bytes are read
            together and not one by one.
        timeout
            How long the lidar may be silent [s], if shorter than the port's timeout.

        Raises
        ------
        SilenceError
            If nothing comes within the timeout.
        DeviceError
            If much data comes that is not SCIP.
        PortError
            If the port fails.
        StoppedError
            If `keep_going` returns False.
        """
        searched = 0
        while (end := self._buffer.find(_END, searched)) < 0:
            searched = max(len(self._buffer) - len(_END) + 1, 0)
            self._fill(expected - len(self._buffer), timeout)
        message = bytes(self._buffer[:end])
        del self._buffer[: end + len(_END)]
        return message

    def useful(self) -> None:
        """Note that the last message was valid, so that the sender is a lidar."""
        self._useless = 0

    def discard(self) -> None:
        """Drop the received bytes."""
        self._buffer.clear()
        with port_errors():
            for _ in range(4):
                self.port.read(self.port.in_waiting)

    def _fill(self, wanted: int, timeout: float) -> None:
        if self._useless > _MOST_USELESS:
            raise DeviceError(
                f'received {self._useless} bytes that are not SCIP 2.0; is it a lidar?'
            )
        data = self.wait(wanted, timeout)
        self._buffer += data
        self._useless += len(data)
