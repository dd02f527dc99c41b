"""A TCP connection in the place of a serial port."""

import array
import fcntl
import termios

from serial.urlhandler.protocol_socket import Serial


class TcpPort(Serial):
    """pyserial's connection, with the number of bytes that wait.

    pyserial says only whether there are any, so that a message would be read byte by byte.
    """

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read at once; at least 1 after the other side hung up."""
        count = array.array('i', [0])
        fcntl.ioctl(self.fileno(), termios.FIONREAD, count)
        return max(count[0], int(super().in_waiting))
