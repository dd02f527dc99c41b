"""Reads a port, and notices soon if it has to stop or if the lidar is silent."""

from collections.abc import Callable
import math

from nodlidar_common.errors import DeviceError, StoppedError
from nodlidar_common.serial_port import port_errors, SerialPort

READ_TIMEOUT = 0.14
"""Longest wait of one read [s]: longer than a revolution of most lidars, of some 0.1 s.

A slower one, of up to 0.2 s, may need a second read, and a stop a second request.
"""


class SilenceError(DeviceError):
    """A lidar that sends nothing."""


class Reader:
    """Reads a port; every failure of the port is a PortError.

    Parameters
    ----------
    port
        An open port.
    clock
        Returns the host time [ns].
    timeout
        How long the lidar may be silent [s].
    keep_going
        Called before every read: False ends the wait with a StoppedError.

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
        with port_errors():
            port.timeout = READ_TIMEOUT

    def wait(self, wanted: int, timeout: float = math.inf) -> bytes:
        """Return the next bytes, at least one, by short reads, so that a stop is noticed soon.

        Parameters
        ----------
        wanted
            How many to wait for, if they come within READ_TIMEOUT.
        timeout
            How long the lidar may be silent [s], if shorter than that of this object.

        Raises
        ------
        SilenceError
            If nothing comes within the timeout.
        PortError
            If the port fails.
        StoppedError
            If `keep_going` returns False.
        """
        timeout = min(timeout, self._timeout)
        for _ in range(math.ceil(timeout / READ_TIMEOUT)):
            if not self._keep_going():
                raise StoppedError('stopped waiting for the lidar')
            if data := self.read(wanted):
                return data
        raise SilenceError(f'the lidar sent nothing for {timeout} s')

    def rest(self) -> bytes:
        """Return what has come meanwhile, without waiting."""
        with port_errors():
            waiting = self._port.in_waiting
        return self.read(waiting) if waiting else b''

    def read(self, wanted: int = 1) -> bytes:
        """Return the next bytes, as soon as there are `wanted` ones or after READ_TIMEOUT."""
        with port_errors():
            data = self._port.read(max(wanted, self._port.in_waiting, 1))
        self.arrival_ns = self._clock()
        return data
