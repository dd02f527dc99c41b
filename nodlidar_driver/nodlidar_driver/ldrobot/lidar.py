"""One LD06 or LD19 on its port: from bytes to scans with ranges and host time."""

from collections import Counter, deque
from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array
from nodlidar_common.errors import DeviceError
from nodlidar_common.ldrobot import BIT_RATE, PACKET, RANGE_MM
from nodlidar_common.serial_port import port_errors
from nodlidar_common.stamps import NS_PER_S
from nodlidar_driver.base.reader import Reader
from nodlidar_driver.clock.arrivals import Arrivals
from nodlidar_driver.ldrobot.packets import take_packets
from nodlidar_driver.ldrobot.revolutions import Revolution, Revolutions
import numpy as np
from numpy.typing import NDArray

_SIZE = PACKET.itemsize
_MS = NS_PER_S // 1000
_LINE_MS = _SIZE * 10 / BIT_RATE * 1e3  # a packet on the line, with start and stop bits
_SETTLING = 10  # revolutions, from which the least delay of their arrivals is known
_WAITED_MS = 20.0  # a revolution that is later than another one by more is none of these
_MOST_SETTLING = 100  # revolutions, after which the line is too late to date any
_MOST_USELESS = 4096  # bytes between two packets: the sender is another device
_MOST_UNEVEN = 3.0  # degrees that a beam may be off; the motor changes its speed

BEAMS, REVOLUTIONS, UNEVEN = 'Beams lost', 'Revolutions lost', 'Revolutions too uneven'
REFUSED, USELESS = 'Packets refused', 'Bytes of no packet'


@dataclass(frozen=True, slots=True)
class LdrobotScan:
    """One revolution; azimuths are counter-clockwise, as ROS has them, and fall from beam to beam.

    Attributes
    ----------
    stamp_ns
        Host time of the first beam [ns].
    revolution
        Time of a revolution at the speed of this one [s].
    azimuth, azimuth_step
        Of the first beam, and from beam to beam [rad].
    ranges
        Ranges [m] by REP 117, shape (n,); NaN where packets were lost, and without confidence.
    confidences
        Strength of the returns, 0 to 255, shape (n,).
    arrival_ns
        Host time at which the last byte was read [ns].
    late
        How much later than usual it arrived [s].
    uneven
        Greatest difference of a beam from its azimuth, as the motor turned unevenly [rad].
    """

    stamp_ns: int
    revolution: float
    azimuth: float
    azimuth_step: float
    ranges: NDArray[np.float32]
    confidences: NDArray[np.float32]
    arrival_ns: int
    late: float
    uneven: float


class LdrobotLidar:
    """Reads the scans of a lidar that sends from power-up on and takes no commands.

    Its timer has whole milliseconds and says nothing of the host's clock. The beams are even in
    time, which gives the fractions; the packets that arrive earliest give the offset and the
    drift: they were measured just before they went over the line.

    Parameters
    ----------
    reader
        Reads the port.
    window
        Least and greatest azimuth of a scan [rad].
    least_confidence
        Returns with less are not trusted.

    Attributes
    ----------
    arrivals
        Of the scans, from which drift and jitter are known.
    lost
        What was lost since connecting, by name.

    Raises
    ------
    PortError
        If the port fails.
    """

    def __init__(self, reader: Reader, window: tuple[float, float], least_confidence: int) -> None:
        self.lost: Counter[str] = Counter()
        self._reader, self._window, self._least_confidence = reader, window, least_confidence
        with port_errors():
            reader.port.reset_input_buffer()  # it says nothing of the time of its arrival
        self._origin_ns = reader.clock()
        self._buffer = bytearray()
        self._useless, self._has_begun = 0, False
        self._revolutions = Revolutions()
        self._done: deque[Revolution] = deque()
        self.arrivals = Arrivals()
        self._newest_ms = 0.0  # at the latest arrival, by the lidar's timer
        self._first: list[tuple[float, float]] = []  # taken, arrived [ms]
        self._lap: int | None = None  # of the last revolution

    def connect(self) -> None:
        """Wait for the first revolution that can be dated; errors are those of :meth:`read`."""
        while not self._done:
            self._receive()

    def read(self) -> LdrobotScan:
        """Wait for the next revolution that can be dated, and return it.

        Raises
        ------
        DeviceError
            If none comes, or the lidar was restarted.
        PortError
            If the port fails.
        StoppedError
            If `keep_going` returns False.
        """
        while not self._done:
            self._receive()
        return self._scan(self._done.popleft())

    def disconnect(self) -> None:
        """Do nothing: laser and motor are on as long as there is power."""

    def _receive(self) -> None:
        """Take the next bytes, up to the end of the revolution."""
        wanted = self._revolutions.packets_to_go * _SIZE - len(self._buffer)
        self._buffer += self._reader.wait(wanted)
        self._buffer += self._reader.rest()  # of what came together, only the last was not late
        packets, useless = take_packets(self._buffer)
        self._useless = useless + (0 if len(packets) else self._useless)
        if self._has_begun:  # the first bytes are the end of a packet
            self.lost[USELESS] += useless
        self._has_begun |= len(packets) > 0
        if self._useless > _MOST_USELESS:
            raise DeviceError(
                f'received {self._useless} bytes that are no packets of an LD06 or LD19; '
                'is it one?'
            )
        revolutions = self._revolutions.add(packets)
        self.lost[REFUSED] = self._revolutions.refused
        if revolutions:
            is_dated = self._is_dated(revolutions[-1])
            self._done += filter(self._count, revolutions) if is_dated else ()

    def _is_dated(self, revolution: Revolution) -> bool:
        """Take note of the latest arrival; return whether enough of them are known."""
        self._newest_ms = revolution.time_ms(self._revolutions.newest)
        arrived_ms = (self._reader.arrival_ns - self._origin_ns) / _MS
        if self.arrivals.is_outdated(arrived_ms):
            raise DeviceError(f'all scans are late, now by {self.arrivals.late_ms:.0f} ms')
        if self.arrivals.is_early(self._newest_ms, arrived_ms):  # all others were late
            self.arrivals.clear()
            self._first.clear()
        if len(self.arrivals):
            self.arrivals.add(np.array([self._newest_ms]), arrived_ms)
            return True
        self._first.append((self._newest_ms, arrived_ms))
        taken, arrived = np.array(self._first).T
        late = arrived - taken - (arrived - taken).min()
        timely = late <= _WAITED_MS
        if timely.sum() == _SETTLING:
            self.arrivals.begin(taken[timely], arrived[timely])
        elif len(late) == _MOST_SETTLING:
            raise DeviceError(
                f'scans are late by {np.median(late):.0f} ms at random: too much to date them'
            )
        return False

    def _count(self, revolution: Revolution) -> bool:
        """Count what is lost of a revolution and before it; return whether it can be used."""
        if self._lap is not None:
            self.lost[REVOLUTIONS] += revolution.lap - self._lap - 1
        self._lap = revolution.lap
        self.lost[BEAMS] += revolution.lost
        is_even = revolution.uneven <= _MOST_UNEVEN
        self.lost[UNEVEN] += not is_even
        return is_even

    def _scan(self, revolution: Revolution) -> LdrobotScan:
        line = self.arrivals.line
        rate = 1.0 + line.slope  # of the host's clock against the lidar's
        azimuth_step = -math.radians(revolution.angle_step)
        beams = np.arange(len(revolution.distances))
        azimuths = math.pi - math.radians(revolution.angle) + azimuth_step * beams
        least, greatest = self._window
        # The azimuths of an uneven revolution may be off, but a full turn has all of its beams.
        is_full = greatest - least > math.tau + azimuth_step
        slack = math.inf if is_full else -azimuth_step / 2.0
        [kept] = np.nonzero((azimuths >= least - slack) & (azimuths <= greatest + slack))
        if not len(kept):
            raise DeviceError(f'no beam is between {least} and {greatest} rad')
        first = int(kept[0])
        chosen = slice(first, int(kept[-1]) + 1)
        confidences = revolution.confidences[chosen]
        first_ms = revolution.time_ms(revolution.first + first)
        host_ms = self._newest_ms + line.value - _LINE_MS - (self._newest_ms - first_ms) * rate
        return LdrobotScan(
            stamp_ns=self._origin_ns + round(host_ms * _MS),
            revolution=revolution.period_ms * rate / 1e3,
            azimuth=float(azimuths[first]),
            azimuth_step=azimuth_step,
            ranges=self._ranges(revolution.distances[chosen], confidences),
            confidences=confidences.astype(np.float32),
            arrival_ns=self._reader.arrival_ns,
            late=self.arrivals.late_ms / 1e3,
            uneven=math.radians(revolution.uneven),
        )

    def _ranges(self, distances: Array, confidences: Array) -> NDArray[np.float32]:
        """Return ranges [m] by REP 117 of distances [mm]: 0 is no return, NaN stays."""
        least, greatest = RANGE_MM
        ranges = distances / 1e3
        ranges[confidences < self._least_confidence] = math.nan
        ranges[(distances < least) & (distances > 0.0)] = -math.inf
        ranges[(distances == 0.0) | (distances > greatest)] = math.inf
        return ranges.astype(np.float32)
