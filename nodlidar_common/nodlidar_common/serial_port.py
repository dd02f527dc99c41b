"""Serial ports, opened for one user only and with errors that say what to do."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import errno
import termios

from nodlidar_common.errors import PortError
import serial

_HINTS = {
    errno.ENOENT: 'it does not exist; is the device plugged in?',
    errno.EACCES: "permission denied; is the user in the group 'dialout'?",
    errno.EBUSY: 'it is in use by another program',
    errno.EWOULDBLOCK: 'it is in use by another program',
    errno.ENOTTY: 'it is no serial port',
    errno.EISDIR: 'it is no serial port',
}


def open_port(path: str, baud_rate: int, timeout: float | None) -> serial.Serial:
    """Open a serial port, locked against a second user.

    Parameters
    ----------
    path
        Device file, for example ``/dev/ttyACM0``.
    baud_rate
        Bit rate [bit/s]; without effect on USB devices and pseudo-terminals.
    timeout
        Longest time that one read blocks [s]; 0 never blocks, None blocks without end.

    Raises
    ------
    PortError
        If the port is missing, forbidden, in use or no serial port.
    """
    try:
        return serial.Serial(path, baud_rate, timeout=timeout, exclusive=True)
    except (OSError, termios.error, ValueError) as error:
        hint = _HINTS.get(_error_number(error), str(error))
        raise PortError(f"cannot open serial port '{path}': {hint}") from error


@contextmanager
def port_errors() -> Iterator[None]:
    """Turn what a port that went away raises within the context into a PortError.

    pyserial raises SerialException (an OSError), also in setting the timeout, which configures the
    port anew, or a plain OSError or, where it flushes, termios.error, which is no OSError.
    """
    try:
        yield
    except (OSError, termios.error) as error:
        raise PortError(f'the serial port went away: {error}') from error


def close_port(port: serial.Serial) -> None:
    """Close a port, also one that went away."""
    with suppress(PortError), port_errors():
        port.close()


def _error_number(error: Exception) -> int:
    """Return the errno of what pyserial raised, or else of what that came from; 0 without one."""
    for cause in (error, error.__context__):
        if isinstance(cause, termios.error):
            return int(cause.args[0])
    return getattr(error, 'errno', None) or getattr(error.__context__, 'errno', None) or 0
