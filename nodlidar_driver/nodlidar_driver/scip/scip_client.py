"""A SCIP 2.0 session with a lidar: start-up, identity, time mode, streaming, stop."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import re

from nodlidar_common import scip
from nodlidar_common.arrays import Integers
from nodlidar_common.errors import DeviceError
from nodlidar_common.guard_process import ATTEMPTS as STOP_ATTEMPTS
from nodlidar_common.scip import ScipError
from nodlidar_driver.base.reader import READ_TIMEOUT
from nodlidar_driver.clock.time_mode import TimeReply
from nodlidar_driver.scip import identity
from nodlidar_driver.scip import scip_status as status_of
from nodlidar_driver.scip.scan_account import CHECKSUM, INCOMPLETE, RESYNC, VERIFYING
from nodlidar_driver.scip.scan_window import ScanWindow
from nodlidar_driver.scip.scip_answer import (
    message_length,
    quit_status,
    refused,
    status_in,
    STOP,
    timer,
)
from nodlidar_driver.scip.scip_port import ScipPort

_SCAN_HEADER = re.compile(rb'M[DS]\d{13}(?=\n)')
# ND, NE, HD and HE: what lidars of SCIP 2.2 send for several echoes per beam.
_ECHOES_HEADER = re.compile(rb'[NH][DE]\d{13}\n')
_WAY_BACK = {status_of.SCIP_1_1_ERROR: 'SCIP2.0', status_of.NOT_IN_THIS_STATE: 'TM2'}
_ATTEMPTS = 5  # SCIP 1.1, time mode and streaming can each cost one
_ANSWER_TIMEOUT = 0.5  # s; an answer takes one revolution
_MESSAGES_BEFORE_ANSWER = 5  # earlier scans, or an answer to half a command
_LONGEST_ANSWER = 8192  # bytes that are searched for the confirmation


@dataclass(frozen=True, slots=True)
class RawScan:
    """A scan as the lidar sent it.

    Attributes
    ----------
    device_ms
        The lidar's timer at step 0 [ms, 24 bits].
    codes
        Ranges [mm], or error codes below 20, shape (window.count,).
    arrival_ns
        Host time at which the last byte was read [ns].
    """

    device_ms: int
    codes: Integers
    arrival_ns: int


class ScipClient:
    """Speaks SCIP 2.0 over a port; without a thread of its own.

    Parameters
    ----------
    port
        The port; its ``keep_going`` ends any wait but that for the answer to QT in :meth:`stop`.
    drop
        Called with the reason for each part of the stream that is not a good scan.
    """

    def __init__(self, port: ScipPort, drop: Callable[[str], None] = lambda reason: None) -> None:
        self._port, self._drop = port, drop
        self._window: ScanWindow | None = None

    def start_session(self) -> None:
        """Bring the lidar from any state to SCIP 2.0, idle, laser off.

        A streaming lidar answers with scans, a lidar in SCIP 1.1 with E, one in time mode with 0E.

        Raises
        ------
        DeviceError
            If the lidar does not get there.
        """
        self._port.discard()
        trouble = DeviceError('the device does not answer as a SCIP 2.0 lidar does')
        for _ in range(_ATTEMPTS):
            status = self._quit()
            if status == status_of.OK:
                return
            if status in _WAY_BACK:
                self._ask(_WAY_BACK[status])
            elif status:
                trouble = refused('QT', status)
        raise trouble

    def version(self) -> identity.Version:
        """Request vendor, firmware and serial number."""
        return identity.version(self._information('VV'))

    def capabilities(self) -> identity.Capabilities:
        """Request ranges, steps and speed."""
        return identity.capabilities(self._information('PP'))

    def state(self) -> identity.State:
        """Request speed and health; this ends a stream."""
        return identity.state(self._information('II'))

    def time_replies(self, enough: Callable[[Sequence[TimeReply]], bool]) -> list[TimeReply]:
        """Read the lidar's timer in time mode until `enough` returns True.

        Returns
        -------
        list of TimeReply
            Empty if the lidar refuses time mode.
        """
        status, _ = self._ask('TM0')
        if status not in (status_of.OK, status_of.TIME_MODE_WAS_ON):
            return []
        replies: list[TimeReply] = []
        while not enough(replies):
            asked_ns = self._port.clock()
            device_ms = timer(b'\n'.join(self._command('TM1')))
            replies.append(TimeReply(device_ms, asked_ns, self._port.arrival_ns))
        self._command('TM2', status_of.TIME_MODE_WAS_OFF)
        return replies

    def start_scanning(self, window: ScanWindow) -> None:
        """Turn the laser on and start the stream of scans."""
        self._command('BM', status_of.LASER_WAS_ON)
        self._command(
            f'MD{window.first_step:04d}{window.last_step:04d}{window.cluster:02d}{window.skip:d}00'
        )
        self._window = window

    def read_scan(self) -> RawScan:
        """Wait for the next good scan of the stream and return it; bad ones are counted.

        Raises
        ------
        DeviceError
            If the lidar falls silent, reports a fault, or sends other data than scans.
        PortError
            If the port fails.
        """
        assert self._window is not None, 'call start_scanning first'
        while True:
            message = self._port.receive(message_length(self._window))
            scan = self._scan(message, self._port.arrival_ns, self._window)
            if scan is not None:
                self._port.useful()
                return scan

    def stop(self) -> None:
        """Stop streaming and turn the laser off; repeat the request until it is confirmed.

        Raises
        ------
        DeviceError
            If the lidar does not confirm it.
        PortError
            If the port fails.
        """
        self._port.discard()  # later bytes may be the answer, however late
        received = b''
        for _ in range(STOP_ATTEMPTS):
            self._port.write(STOP.request)
            deadline_ns = self._port.clock() + round(READ_TIMEOUT * 1e9)
            while (data := self._port.read()) and self._port.clock() < deadline_ns:
                received = (received + data)[-_LONGEST_ANSWER:]
                if re.search(STOP.confirmation, received):
                    return
        raise DeviceError('the lidar did not confirm that its laser is off')

    def _quit(self) -> str:
        """Request a stop; return the status of the answer, empty if there is none."""
        self._port.write(STOP.request)
        for _ in range(_MESSAGES_BEFORE_ANSWER):
            status = quit_status(self._port.receive(timeout=_ANSWER_TIMEOUT))
            if status:
                self._port.useful()
                return status
        return ''

    def _information(self, command: str) -> dict[str, str]:
        return dict(map(scip.parse_information, self._command(command)))

    def _command(self, command: str, also_good: str = status_of.OK) -> list[bytes]:
        """Send a command and return the data lines of its answer; DeviceError if refused."""
        status, lines = self._ask(command)
        if status not in (status_of.OK, also_good):
            raise refused(command, status)
        return lines

    def _ask(self, command: str) -> tuple[str, list[bytes]]:
        """Send a command; return status and data lines; ScipError if the echo differs."""
        self._port.send(command)
        echo, *lines = self._port.receive(timeout=_ANSWER_TIMEOUT).split(b'\n')
        if echo != command.encode('ascii') or not lines:
            raise ScipError(f"the answer to '{command}' begins with {echo!r}")
        self._port.useful()
        return status_in(lines[0]), lines[1:]

    def _scan(self, message: bytes, arrival_ns: int, window: ScanWindow) -> RawScan | None:
        """Return the scan at the end of a message, or None; errors are counted."""
        if _ECHOES_HEADER.match(message):
            raise DeviceError('the lidar sends several echoes per beam, which is not supported')
        headers = list(_SCAN_HEADER.finditer(message))
        if len(headers) != 1 or headers[0].start() > 0:
            self._drop(RESYNC)
        if not headers:
            return None
        message = message[headers[-1].start() :]
        command, *lines = message.split(b'\n')
        try:
            status = status_in(lines[0]) if lines else ''
            if status == status_of.SCAN_DATA:
                return self._scan_data(lines[1:], arrival_ns, window)
        except ScipError:
            complete = len(message) == message_length(window) - 2
            self._drop(CHECKSUM if complete else INCOMPLETE)
            return None
        self._check_stopped(command.decode('ascii'), status)
        return None

    def _scan_data(self, lines: list[bytes], arrival_ns: int, window: ScanWindow) -> RawScan:
        codes = scip.decode(scip.join_blocks(lines[1:]), 3)
        if len(codes) != window.count:
            raise ScipError(f'{len(codes)} ranges instead of {window.count}')
        return RawScan(timer(lines[0]), codes, arrival_ns)

    def _check_stopped(self, command: str, status: str) -> None:
        """Raise DeviceError if the hardware failed; count errors that do not end the stream."""
        if status_of.is_fault(status):
            raise refused(command, status)
        if status_of.is_verifying(status):
            self._drop(VERIFYING)
        elif status != status_of.RESUMED:
            self._drop(CHECKSUM)  # no scan has such a status: corrupt despite its sum
