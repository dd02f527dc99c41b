"""What a lidar reports and how well its scans are dated, from some seconds of its stream."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import DeviceError
from nodlidar_common.ldrobot import ROTATION_RATE
from nodlidar_driver.base.diagnosis import LidarDiagnosis
from nodlidar_driver.clock.arrivals import Arrivals
from nodlidar_driver.clock.device_clock import DeviceClock
from nodlidar_driver.ldrobot.diagnosis import LdrobotDiagnosis
from nodlidar_driver.ldrobot.lidar import LdrobotLidar, LdrobotScan
from nodlidar_driver.scip.diagnosis import ScipDiagnosis
from nodlidar_driver.scip.identity import Capabilities, State, Version
from nodlidar_driver.scip.lidar import Lidar, Scan
from nodlidar_driver.scip.scan_account import ScanAccount
import numpy as np
from numpy.typing import NDArray

LEAST_SCANS = 10  # that rates and clock are judged by


class NoLidarError(DeviceError):
    """A port at which the lidar does not answer."""


@dataclass(frozen=True, slots=True)
class Identity:
    """What a Hokuyo says of itself: its answers to VV, PP and II."""

    version: Version
    capabilities: Capabilities
    state: State


@dataclass(frozen=True, slots=True)
class ClockQuality:
    """How well the scans are dated.

    Attributes
    ----------
    synchronised
        Whether the lidar answered in time mode; without it the offset is assumed.
    drift_ppm
        Rate of the lidar's clock against the host's, less 1 [parts per million].
    residual
        RMS deviation of the stamps from evenly spaced revolutions [s]: also of the motor.
    jitter
        Mean lateness of the scans, without those that waited [s].
    latest
        Greatest lateness of a scan [s].
    latency
        Median time from the first beam to the arrival of the scan [s].
    """

    synchronised: bool
    drift_ppm: float
    residual: float
    jitter: float
    latest: float
    latency: float


@dataclass(frozen=True, slots=True)
class Probe:
    """A lidar, as it reports itself and as it was measured.

    Attributes
    ----------
    identity
        What it says of itself; None of an LD06 or LD19, which says nothing.
    scans
        Number of scans that were read.
    rate, nominal_rate
        Scans per second, as measured, and as the lidar or its maker says [Hz].
    lost
        What was lost, by name.
    seen, nothing, too_near, doubtful
        Shares of the beams: with a range, with nothing in range, too near, without a range that
        can be trusted.
    clock
        How well the scans are dated.
    uneven
        Greatest difference of a beam from its azimuth, as the motor turned unevenly [rad]; None
        of a Hokuyo, whose steps have fixed azimuths.
    warnings
        What is unusual, in words.
    azimuths, ranges
        The last scan [rad] and [m], by REP 117, shape (n,).
    """

    identity: Identity | None
    scans: int
    rate: float
    nominal_rate: float
    lost: Mapping[str, int]
    seen: float
    nothing: float
    too_near: float
    doubtful: float
    clock: ClockQuality
    uneven: float | None
    warnings: Sequence[str]
    azimuths: Array
    ranges: NDArray[np.float32]

    def numbers(self) -> dict[str, Any]:
        """Return all but the last scan, of types that JSON has; SI units."""
        kept = {n: v for n, v in asdict(self).items() if n not in ('azimuths', 'ranges')}
        least, greatest = self.limits
        return kept | {'beams': len(self.ranges), 'angle_min': least, 'angle_max': greatest}

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest azimuth of the last scan [rad]."""
        return float(self.azimuths.min()), float(self.azimuths.max())


def probe_scip(lidar: Lidar, account: ScanAccount, seconds: float) -> Probe:
    """Read the stream of a connected Hokuyo for a time and judge it.

    Parameters
    ----------
    lidar
        A lidar that streams.
    account
        Counts its scans.
    seconds
        How long to read [s]; at least LEAST_SCANS scans are read.

    Raises
    ------
    DeviceError
        If the stream fails.
    PortError
        If the port fails.
    """
    scans, warnings = _read(lidar, ScipDiagnosis(lidar.window.skip, account), seconds)
    window, clock = lidar.window, lidar.device_clock
    return Probe(
        identity=Identity(lidar.version, lidar.capabilities, lidar.state),
        nominal_rate=1.0 / lidar.capabilities.revolution,
        lost={reason: count for reason, count in account.lost.items() if count},
        clock=_clock_quality(scans, clock, clock.synchronised),
        uneven=None,
        warnings=warnings,
        azimuths=window.angle_min + window.angle_increment * np.arange(window.count),
        **_stream(scans),
    )


def probe_ldrobot(lidar: LdrobotLidar, seconds: float) -> Probe:
    """Read the stream of a connected LD06 or LD19 for a time and judge it.

    Parameters, errors as for :func:`probe_scip`.
    """
    scans, warnings = _read(lidar, LdrobotDiagnosis(), seconds)
    last = scans[-1]
    return Probe(
        identity=None,
        nominal_rate=ROTATION_RATE,
        lost={name: count for name, count in lidar.lost.items() if count},
        clock=_clock_quality(scans, lidar.arrivals, synchronised=False),
        uneven=max(scan.uneven for scan in scans),
        warnings=warnings,
        azimuths=last.azimuth + last.azimuth_step * np.arange(len(last.ranges)),
        **_stream(scans),
    )


def _read(
    lidar: Any, diagnosis: LidarDiagnosis, seconds: float
) -> tuple[list[Any], tuple[str, ...]]:
    """Return the scans of a time [s], and what is unusual."""
    scans = [lidar.read()]
    diagnosis.connected(lidar, scans[0].arrival_ns)
    diagnosis.published(scans[0])
    diagnosis.next_report(scans[0].arrival_ns)  # the rate counts from here
    while len(scans) < LEAST_SCANS or _duration(scans) < seconds:
        scans.append(lidar.read())
        diagnosis.published(scans[-1])
    return scans, tuple(diagnosis.next_report(scans[-1].arrival_ns).warnings)


def residual(stamps_ns: Times, revolution: float) -> float:
    """Return the RMS deviation of stamps from evenly spaced revolutions [s].

    Parameters
    ----------
    stamps_ns
        Increasing stamps of scans [ns], shape (n,), n >= 2; revolutions may be missing.
    revolution
        Time of one revolution [s], to 1 % or better: neighbouring stamps are counted by it.
    """
    times = (stamps_ns - stamps_ns[0]) * 1e-9
    numbers = np.cumsum(np.r_[0, np.round(np.diff(times) / revolution)])
    times, numbers = times - times.mean(), numbers - numbers.mean()
    period = numbers @ times / (numbers @ numbers)
    return float(np.sqrt(np.mean((times - period * numbers) ** 2)))


def _stream(scans: Sequence[Scan | LdrobotScan]) -> dict[str, Any]:
    """Return what is the same for all lidars."""
    values = np.concatenate([scan.ranges for scan in scans])
    return {
        'scans': len(scans),
        'rate': (len(scans) - 1) / _duration(scans),
        'seen': float(np.isfinite(values).mean()),
        'nothing': float(np.isposinf(values).mean()),
        'too_near': float(np.isneginf(values).mean()),
        'doubtful': float(np.isnan(values).mean()),
        'ranges': scans[-1].ranges,
    }


def _clock_quality(
    scans: Sequence[Scan | LdrobotScan], clock: DeviceClock | Arrivals, synchronised: bool
) -> ClockQuality:
    stamps_ns = np.array([scan.stamp_ns for scan in scans])
    arrivals_ns = np.array([scan.arrival_ns for scan in scans])
    return ClockQuality(
        synchronised=synchronised,
        drift_ppm=clock.drift_ppm,
        residual=residual(stamps_ns, scans[-1].revolution),
        jitter=clock.jitter,
        latest=max(scan.late for scan in scans),
        latency=float(np.median(arrivals_ns - stamps_ns)) * 1e-9,
    )


def _duration(scans: Sequence[Scan | LdrobotScan]) -> float:
    """Return the time from the first to the last scan [s]; 0 for one scan."""
    return (scans[-1].stamp_ns - scans[0].stamp_ns) * 1e-9
