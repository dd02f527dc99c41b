"""Lidars with third-party drivers: how their beams lie, and what those drivers publish.

docs/lidars.md names the versions of the drivers whose sources these shapes are from.
"""

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import NamedTuple

from nodlidar_common.arrays import Array, Integers, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.sensor_model import instants
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Revolution:
    """A revolution and when the driver got it; beams are in the order of time.

    Attributes
    ----------
    times_ns, azimuths
        Time [ns] and azimuth [rad] of each beam, shape (n,).
    period
        Time since the first beam of the revolution before [s]; 0 if there was none.
    waited_since_ns, fetched_ns
        When the driver began to wait for it, and when it had it [ns].
    """

    times_ns: Times
    azimuths: Array
    period: float
    waited_since_ns: int
    fetched_ns: int

    @property
    def waited(self) -> float:
        """Time that the driver waited for it [s]."""
        return (self.fetched_ns - self.waited_since_ns) / NS_PER_S


class ScanTimes(NamedTuple):
    """What a message says of time; names and units of LaserScan, but for the stamp [ns]."""

    stamp_ns: int
    scan_time: float
    time_increment: float


class Published(NamedTuple):
    """The content of a LaserScan, with its names and units, but for the stamp [ns]."""

    stamp_ns: int
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class OtherLidar:
    """A lidar and its driver.

    Attributes
    ----------
    beams
        Fewest and most beams of a revolution.
    beam_period
        Time from a beam to the next [s].
    azimuths
        Of the beam that is measured first and of the last one [rad].
    lost
        What is published for a beam without a range.
    times
        What the driver's messages say of time.
    dark_steps
        Steps of a revolution without a beam.
    range_min, range_max
        Measurable ranges [m].
    poll_period
        Time from one look of the driver for a revolution to the next [s]; 0 if it waits for it.
    best_effort
        Whether the driver publishes best effort.
    """

    beams: tuple[int, int]
    beam_period: float
    azimuths: tuple[float, float]
    lost: float
    times: Callable[[Revolution], ScanTimes]
    dark_steps: int = 0
    range_min: float = 0.05
    range_max: float = 12.0
    poll_period: float = 0.0
    best_effort: bool = False

    def rays(self, begin_ns: int, beams: int, clock_rate: float = 1.0) -> tuple[Integers, Array]:
        """Return time [ns] and azimuth [rad] of the beams of a revolution, shape (beams,) each."""
        times_ns = instants(begin_ns, np.arange(beams) * (self.beam_period / clock_rate))
        return times_ns, np.linspace(*self.azimuths, beams)

    def published(self, revolution: Revolution, ranges: Array) -> Published:
        """Return what the driver publishes of a revolution.

        Parameters
        ----------
        revolution
            Its beams.
        ranges
            Measured [m], shape (n,): inf without a surface, NaN for a lost beam.
        """
        times, azimuths = self.times(revolution), revolution.azimuths
        measured = (ranges >= self.range_min) & (ranges <= self.range_max)
        ranges = np.where(measured, ranges, self.lost)
        if azimuths[0] > azimuths[-1]:  # clockwise: the driver reverses the beams
            azimuths, ranges = azimuths[::-1], ranges[::-1]
        return Published(
            stamp_ns=times.stamp_ns,
            angle_min=float(azimuths[0]),
            angle_max=float(azimuths[-1]),
            angle_increment=float((azimuths[-1] - azimuths[0]) / (len(azimuths) - 1)),
            time_increment=times.time_increment,
            scan_time=times.scan_time,
            range_min=self.range_min,
            range_max=self.range_max,
            ranges=ranges.astype(np.float32),
        )


def _rplidar(revolution: Revolution) -> ScanTimes:
    """sllidar_node.cpp: the stamp is when it began to wait, scan_time how long that took."""
    waited = revolution.waited
    return ScanTimes(revolution.waited_since_ns, waited, waited / (len(revolution.times_ns) - 1))


def _ldlidar(revolution: Revolution) -> ScanTimes:
    """demo.cpp: the stamp is when it polls, scan_time the time since it published before."""
    waited = revolution.waited
    return ScanTimes(revolution.fetched_ns, waited, waited / (len(revolution.times_ns) - 1))


def _ydlidar(revolution: Revolution) -> ScanTimes:
    """CYdLidar.cpp: the stamp is the first beam's, time_increment by the count, first 0."""
    beams, period = len(revolution.times_ns), revolution.period
    return ScanTimes(int(revolution.times_ns[0]), period, period / beams)


def _urg_node2(revolution: Revolution) -> ScanTimes:
    """urg_node2.cpp: times as of the specification; its calibration leaves no delay here."""
    return ScanTimes(int(revolution.times_ns[0]), 0.025, 0.025 / 1440)


OTHER_LIDARS = {
    'rplidar': OtherLidar((720, 720), 0.1 / 720, (math.pi, -math.pi), math.inf, _rplidar),
    # It measures at a fixed rate while its speed drifts.
    'ldlidar': OtherLidar(
        (447, 454), 1.0 / 4500.0, (math.tau, 0.0), math.nan, _ldlidar, poll_period=0.1
    ),
    'ydlidar': OtherLidar(
        (505, 505), 0.1 / 505, (math.pi, -math.pi), 0.0, _ydlidar, best_effort=True
    ),
    'urg_node2': OtherLidar(
        (1081, 1081),
        0.025 / 1440,
        (-0.75 * math.pi, 0.75 * math.pi),
        math.nan,
        _urg_node2,
        dark_steps=359,
    ),
}
"""By the value of the launch argument `lidar`."""
