"""Serial ports, locked against a second user, and TCP connections; errors say what to do."""

from contextlib import suppress
import errno
import re
import termios
from typing import Protocol
from urllib.parse import urlsplit

from nodlidar_common.errors import PortError
from nodlidar_common.tcp_port import TcpPort
import serial

TCP = 'tcp://'
TCP_PORT = 10940  # that of lidars of SCIP 2.0

LONGEST_WRITE = 1.0  # s; a device that takes nothing for this long has failed

_HINTS = {
    errno.ENOENT: 'it does not exist; is the device plugged in?',
    errno.EACCES: "permission denied; add your user to the group 'dialout'",
    errno.EBUSY: 'it is in use by another program',
    errno.EWOULDBLOCK: 'it is in use by another program',
    errno.ENOTTY: 'it is not a serial port',
    errno.EISDIR: 'it is not a serial port',
}


class SerialPort(Protocol):
    """The part of pyserial's ``Serial`` that the devices use."""

    timeout: float | None

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read at once."""

    def read(self, size: int = 1, /) -> bytes:
        """Return that many bytes, or fewer after the timeout."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""

    def reset_input_buffer(self) -> None:
        """Drop the received bytes."""


OpenPort = serial.Serial | TcpPort


def open_port(path: str, baud_rate: int, timeout: float | None) -> OpenPort:
    """Open a serial port, locked against a second user.

    Parameters
    ----------
    path
        Device file, for example ``/dev/ttyACM0``, or ``tcp://ADDRESS:PORT``.
    baud_rate
        Bit rate [bit/s]; without effect on USB devices and pseudo-terminals.
    timeout
        Longest time that one read blocks [s]; with 0 it never blocks, with None forever.

    Raises
    ------
    PortError
        If the port is missing, forbidden, in use or not a serial port, or nobody answers there.
    """
    if path.startswith(TCP):
        return _connected(path, timeout)
    try:
        return serial.Serial(
            path, baud_rate, timeout=timeout, write_timeout=LONGEST_WRITE, exclusive=True
        )
    except (OSError, termios.error, ValueError) as error:
        number = _error_number(error)
        hint = _HINTS.get(number, str(error))
        if number == errno.ENOENT and re.match(r'tcp:|\d+(\.\d+){3}', path):
            hint += f' One on a network is {TCP}ADDRESS'
        raise PortError(f"cannot open serial port '{path}': {hint}") from error


def _connected(url: str, timeout: float | None) -> TcpPort:
    """Return a connection to ``tcp://ADDRESS:PORT``; trying takes up to LONGEST_CONNECTING."""
    address = url.removeprefix(TCP).rstrip(':')
    try:
        port = f':{TCP_PORT}' if urlsplit(url).port is None else ''
        return TcpPort(f'socket://{address}{port}', timeout=timeout)
    except (OSError, ValueError) as error:
        raise PortError(f"cannot connect to '{url}': {error}") from error


class _PortErrors:
    """A context as a class: as a generator it would take three times as long, often per cycle."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if isinstance(error, (OSError, termios.error)):
            raise PortError(f'the device went away: {error}') from error


_PORT_ERRORS = _PortErrors()


def port_errors() -> _PortErrors:
    """Return a context that raises the errors of an unplugged port as a PortError.

    pyserial raises SerialException (an OSError), even when the timeout is set, since that
    configures the port again; or a plain OSError; or, in flushing, termios.error, which is not an
    OSError.
    """
    return _PORT_ERRORS


def close_port(port: OpenPort) -> None:
    """Close a port, even if it was unplugged."""
    with suppress(PortError), port_errors():
        port.close()


def _error_number(error: Exception) -> int:
    """Return the errno of an error of pyserial, or else of its cause; 0 without one."""
    for cause in (error, error.__context__):
        if isinstance(cause, termios.error):
            return int(cause.args[0])
    return getattr(error, 'errno', None) or getattr(error.__context__, 'errno', None) or 0
