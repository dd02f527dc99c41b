"""A TCP connection in the place of a serial port."""

import array
import fcntl
import termios

from serial.urlhandler import protocol_socket

# Connecting to an address takes at most this long [s], which nothing interrupts. A lidar in the
# same network answers at once, and a lost packet is sent again after 1 s. It holds for all
# connections of pyserial in this process.
LONGEST_CONNECTING = 1.5
protocol_socket.POLL_TIMEOUT = LONGEST_CONNECTING


class TcpPort(protocol_socket.Serial):
    """pyserial's connection, with the number of bytes that wait.

    pyserial says only whether there are any, so that a message would be read byte by byte.
    """

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read at once; at least 1 after the other side hung up."""
        count = array.array('i', [0])
        fcntl.ioctl(self.fileno(), termios.FIONREAD, count)
        return max(count[0], int(super().in_waiting))
