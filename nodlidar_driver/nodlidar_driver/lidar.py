"""A connected lidar: from its bytes to scans with ranges and host time."""

from collections.abc import Callable
from dataclasses import dataclass

from nodlidar_driver.device_clock import DeviceClock, enough_replies
from nodlidar_driver.scan import ranges, ScanWindow, STEPS_PER_TURN
from nodlidar_driver.scip_client import ScipClient
from nodlidar_driver.scip_port import SerialPort
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan.

    Attributes
    ----------
    stamp_ns
        Host time of the first beam [ns]; of a cluster, its centre.
    rotation
        Time of one rotation [s], as measured.
    ranges
        Ranges [m] by REP 117, shape (window.count,).
    arrival_ns
        Host time at which the last byte was read [ns].
    """

    stamp_ns: int
    rotation: float
    ranges: NDArray[np.float32]
    arrival_ns: int


class Lidar:
    """Identifies a lidar, aligns its clock with the host's and reads its scans.

    Parameters
    ----------
    port
        An open serial port, as pyserial's.
    window
        The beams that are wanted.
    clock
        Returns the host time [ns].
    timeout
        How long the lidar may be silent [s].
    keep_going
        False ends any wait for the lidar with a StoppedError, but that in :meth:`stop`.

    Attributes
    ----------
    version, capabilities, state
        What the lidar says about itself, before the stream; set by :meth:`start`.
    client
        The session; it counts the scans that were dropped.
    device_clock
        What is known about the lidar's clock; set by :meth:`start`.
    missed
        Rotations whose scan should have come but did not, or was dropped.

    Raises
    ------
    PortError
        If the port fails.
    """

    def __init__(
        self,
        port: SerialPort,
        window: ScanWindow,
        clock: Callable[[], int],
        timeout: float,
        keep_going: Callable[[], bool] = lambda: True,
    ) -> None:
        self.missed = 0
        self._window = window
        self.client = ScipClient(port, clock, timeout, keep_going)

    def start(self) -> None:
        """Bring the lidar to streaming; if that fails, its laser may be on until :meth:`stop`.

        Raises
        ------
        DeviceError
            If it does not answer, refuses, is faulty or does not measure these beams.
        PortError
            If the port fails.
        """
        self.client.start_session()
        self.version = self.client.version()
        self.capabilities = self.client.capabilities()
        self.state = self.client.state()
        self._window.check_measured_by(self.capabilities)
        self.device_clock = self._align_clock()
        self.client.start_scanning(self._window)

    def read(self) -> Scan:
        """Return the next good scan, waiting for it; raises DeviceError if none comes."""
        raw, lidar = self.client.read_scan(), self.capabilities
        time = self.device_clock.scan_time(raw.device_ms, raw.arrival_ns)
        self.missed += max(time.turns - 1 - self._window.skip, 0)
        first_beam_ns = self._window.first_beam * time.rotation * 1e9 / STEPS_PER_TURN
        return Scan(
            stamp_ns=time.step_zero_ns + round(first_beam_ns),
            rotation=time.rotation,
            ranges=ranges(raw.codes, lidar.range_min_mm, lidar.range_max_mm),
            arrival_ns=raw.arrival_ns,
        )

    def stop(self) -> None:
        """Stop the stream and turn the laser off."""
        self.client.stop()

    def _align_clock(self) -> DeviceClock:
        rotation_ms = self.capabilities.rotation * 1e3
        measured_ms = (self._window.last_step + 1) / STEPS_PER_TURN * rotation_ms
        return DeviceClock(rotation_ms, measured_ms, self.client.time_replies(enough_replies))
