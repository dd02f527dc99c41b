"""One lidar on its port: from bytes to scans with ranges and host time."""

from collections.abc import Callable
from dataclasses import dataclass

from nodlidar_common.errors import PortError
from nodlidar_driver.clock.device_clock import DeviceClock, ScanTime
from nodlidar_driver.clock.time_mode import enough_replies
from nodlidar_driver.scip.identity import Capabilities
from nodlidar_driver.scip.scan_account import ScanAccount, SETTLING, TIMESTAMP
from nodlidar_driver.scip.scan_window import ranges, ScanWindow
from nodlidar_driver.scip.scip_client import RawScan, ScipClient
from nodlidar_driver.scip.scip_port import ScipPort
import numpy as np
from numpy.typing import NDArray

_SLACK = 0.05  # uncertainty of the end of a revolution, as a share


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan.

    Attributes
    ----------
    stamp_ns
        Host time of the first beam [ns], or of the centre of the first cluster.
    revolution
        Time of one revolution [s], as measured.
    ranges
        Ranges [m] by REP 117, shape (window.count,).
    arrival_ns
        Host time at which the last byte was read [ns].
    late
        How much later than usual it arrived [s].
    """

    stamp_ns: int
    revolution: float
    ranges: NDArray[np.float32]
    arrival_ns: int
    late: float


class Lidar:
    """Identifies a lidar, aligns its clock with the host's and reads its scans.

    Parameters
    ----------
    port
        The port; its ``keep_going`` ends any wait but that in :meth:`disconnect`.
    choose
        Returns the requested beams of a lidar with given capabilities.
    account
        Counts the scans.

    Attributes
    ----------
    version, capabilities, state
        What the lidar reports about itself before the stream; set by :meth:`connect`.
    window
        The beams of the scans; set by :meth:`connect`.
    client
        The session.
    device_clock
        Maps the lidar's clock to host time; set by :meth:`connect`.
    """

    def __init__(
        self,
        port: ScipPort,
        choose: Callable[[Capabilities], ScanWindow],
        account: ScanAccount,
    ) -> None:
        self._clock, self._choose, self._account = port.clock, choose, account
        self._last: ScanTime | None = None
        self.client = ScipClient(port, account.drop)

    def connect(self) -> None:
        """Start the stream; if that fails, the laser may be on until :meth:`disconnect`.

        Raises
        ------
        DeviceError
            If the lidar does not answer, refuses, is faulty or does not measure these beams.
        PortError
            If the port fails.
        """
        self.client.start_session()
        self.version = self.client.version()
        self.capabilities = self.client.capabilities()
        self.state = self.client.state()
        self.window = self._choose(self.capabilities)
        self.device_clock = self._align_clock()
        self.client.start_scanning(self.window)

    def read(self) -> Scan:
        """Wait for the next good scan that can be dated, and return it.

        Raises
        ------
        DeviceError
            If none comes, the lidar is faulty, or its clock has to be aligned again.
        PortError
            If the port fails.
        """
        while True:
            raw = self.client.read_scan()
            time = self.device_clock.scan_time(raw.device_ms, raw.arrival_ns)
            if time is not None:
                return self._scan(raw, time)
            self._account.drop(TIMESTAMP if self.device_clock.settled else SETTLING)

    def disconnect(self) -> None:
        """Stop the stream and turn the laser off.

        Raises
        ------
        DeviceError
            If the lidar does not confirm it.
        PortError
            If the port fails.
        """
        asked_ns, confirmed_ns = self._clock(), None
        try:
            self.client.stop()
            confirmed_ns = self._clock()
        except PortError:
            self._last = None  # an unplugged lidar may not have sent any more
            raise
        finally:
            self._account.end(self._due_until(asked_ns, confirmed_ns))
            self._last = None

    def _scan(self, raw: RawScan, time: ScanTime) -> Scan:
        self._account.publish(round(time.revolutions / (self.window.skip + 1)) or None)
        self._last = time
        before = self.window.first_beam / self.window.steps_per_revolution
        return Scan(
            stamp_ns=time.step_zero_ns + round(before * time.revolution * 1e9),
            revolution=time.revolution,
            ranges=ranges(
                raw.codes, self.capabilities.range_min_mm, self.capabilities.range_max_mm
            ),
            arrival_ns=raw.arrival_ns,
            late=time.late,
        )

    def _due_until(self, asked_ns: int, confirmed_ns: int | None) -> int | None:
        """Return how many scans were due since the last one, until the lidar stopped.

        It stops at the end of the revolution in which it is asked to, does not send this one and
        confirms the stop; times are in ns, the second one None if there was no confirmation.
        """
        last = self._last
        if last is None:
            return None
        stop_ns = asked_ns if confirmed_ns is None else confirmed_ns
        sent = (stop_ns - last.step_zero_ns) * 1e-9 / last.revolution
        if confirmed_ns is not None:
            sent += _SLACK - 1.0
        return max(int(sent) - 1, 0) // (self.window.skip + 1)

    def _align_clock(self) -> DeviceClock:
        revolution_ms = self.capabilities.revolution * 1e3
        measured = (self.window.last_step + 1) / self.window.steps_per_revolution
        replies = self.client.time_replies(lambda so_far: enough_replies(so_far, revolution_ms))
        return DeviceClock(revolution_ms, measured * revolution_ms, replies)
