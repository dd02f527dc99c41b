"""Reads a port, and notices soon if it has to stop or if the lidar is silent."""

from collections.abc import Callable
from dataclasses import dataclass, field
import math

from nodlidar_common.errors import DeviceError, StoppedError
from nodlidar_common.guard_process import LONGEST_STANDSTILL
from nodlidar_common.serial_port import port_errors, SerialPort

READ_TIMEOUT = 0.14
"""Longest wait of one read [s]: longer than a revolution of most lidars, of some 0.1 s.

A slower one, of up to 0.2 s, may need a second read, and a stop a second request.
"""


class SilenceError(DeviceError):
    """A lidar that sends nothing."""


@dataclass(slots=True)
class Reader:
    """Reads a port; every failure of the port is a PortError.

    Attributes
    ----------
    port
        An open serial port, as pyserial's.
    clock
        Returns the host time [ns], by a clock that runs evenly.
    timeout
        How long the lidar may be silent [s].
    keep_going
        Called before every read in :meth:`wait`: False ends the wait with a StoppedError.
    arrival_ns
        Host time [ns] at which the last bytes were read.
    """

    port: SerialPort
    clock: Callable[[], int]
    timeout: float
    keep_going: Callable[[], bool] = lambda: True
    arrival_ns: int = field(init=False)
    _stood_still: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        with port_errors():
            self.port.timeout = READ_TIMEOUT
        self.arrival_ns = self.clock()

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
            If nothing comes within the timeout; after a standstill of this process for which its
            guard has turned the laser off, within READ_TIMEOUT.
        PortError
            If the port fails.
        StoppedError
            If `keep_going` returns False.
        """
        timeout = min(timeout, self.timeout)
        for _ in range(math.ceil(timeout / READ_TIMEOUT)):
            if not self.keep_going():
                raise StoppedError('stopped waiting for the lidar')
            last_ns = self.arrival_ns
            data = self.read(wanted)
            self._stood_still |= self.arrival_ns - last_ns > LONGEST_STANDSTILL * 1e9
            if data:
                return data
            if self._stood_still:
                raise SilenceError('the lidar has sent nothing since this node stood still')
        raise SilenceError(f'the lidar sent nothing for {timeout} s')

    def rest(self) -> bytes:
        """Return what has come meanwhile, without waiting."""
        with port_errors():
            waiting = self.port.in_waiting
        return self.read(waiting) if waiting else b''

    def read(self, wanted: int = 1) -> bytes:
        """Return the next bytes, as soon as there are `wanted` ones or after READ_TIMEOUT."""
        with port_errors():
            data = self.port.read(max(wanted, self.port.in_waiting, 1))
        self.arrival_ns = self.clock()
        return data
