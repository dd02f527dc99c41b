"""What a lidar reports and how well its scans are dated, from some seconds of its stream."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from nodlidar_common.errors import DeviceError
from nodlidar_driver.diagnosis import Diagnosis
from nodlidar_driver.lidar import Lidar, Scan
from nodlidar_driver.scip.identity import Capabilities, State, Version
from nodlidar_driver.scip.scan import ScanWindow
from nodlidar_driver.scip.scan_account import ScanAccount
import numpy as np
from numpy.typing import NDArray

LEAST_SCANS = 10  # that rates and clock are judged by


class NoLidarError(DeviceError):
    """A port at which no lidar of SCIP 2.0 answers."""


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
        RMS deviation of the stamps from evenly spaced revolutions [s].
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
    version, capabilities, state
        The answers to VV, PP and II.
    window
        The beams that were requested.
    scans
        Number of scans that were read.
    rate
        Scans per second, as measured [Hz].
    lost
        Scans that were lost, by reason.
    seen, nothing, too_near, doubtful
        Shares of the beams: with a range, with nothing in range, too near, without a range that
        can be trusted.
    clock
        How well the scans are dated.
    warnings
        What is unusual, in words.
    ranges
        The last scan [m], by REP 117, shape (window.count,).
    """

    version: Version
    capabilities: Capabilities
    state: State
    window: ScanWindow
    scans: int
    rate: float
    lost: Mapping[str, int]
    seen: float
    nothing: float
    too_near: float
    doubtful: float
    clock: ClockQuality
    warnings: Sequence[str]
    ranges: NDArray[np.float32]

    def numbers(self) -> dict[str, Any]:
        """Return all but the ranges, of types that JSON has; SI units."""
        kept = {name: value for name, value in asdict(self).items() if name != 'ranges'}
        angles = {'angle_min': self.window.angle_min, 'angle_max': self.window.angle_max}
        return kept | {'window': kept['window'] | angles, 'nominal_rate': self.nominal_rate}

    @property
    def nominal_rate(self) -> float:
        """Scans per second by the lidar's own report [Hz]."""
        return 1.0 / self.capabilities.revolution


def probe(lidar: Lidar, account: ScanAccount, seconds: float) -> Probe:
    """Read the stream of a connected lidar for a time and judge it.

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
    diagnosis = Diagnosis(lidar.window.skip, account)
    scans = [lidar.read()]
    diagnosis.connected(lidar, scans[0].arrival_ns)
    diagnosis.published(scans[0])
    diagnosis.next_report(scans[0].arrival_ns)  # the rate counts from here
    while len(scans) < LEAST_SCANS or _duration(scans) < seconds:
        scans.append(lidar.read())
        diagnosis.published(scans[-1])
    return _judged(lidar, account, scans, diagnosis.next_report(scans[-1].arrival_ns).warnings)


def residual(stamps_ns: NDArray[np.int64], revolution: float) -> float:
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


def _judged(
    lidar: Lidar, account: ScanAccount, scans: Sequence[Scan], warnings: Sequence[str]
) -> Probe:
    values = np.concatenate([scan.ranges for scan in scans])
    return Probe(
        version=lidar.version,
        capabilities=lidar.capabilities,
        state=lidar.state,
        window=lidar.window,
        scans=len(scans),
        rate=(len(scans) - 1) / _duration(scans),
        lost={reason: count for reason, count in account.lost.items() if count},
        seen=float(np.isfinite(values).mean()),
        nothing=float(np.isposinf(values).mean()),
        too_near=float(np.isneginf(values).mean()),
        doubtful=float(np.isnan(values).mean()),
        clock=_clock_quality(lidar, scans),
        warnings=tuple(warnings),
        ranges=scans[-1].ranges,
    )


def _clock_quality(lidar: Lidar, scans: Sequence[Scan]) -> ClockQuality:
    stamps_ns = np.array([scan.stamp_ns for scan in scans])
    arrivals_ns = np.array([scan.arrival_ns for scan in scans])
    return ClockQuality(
        synchronised=lidar.device_clock.synchronised,
        drift_ppm=lidar.device_clock.drift_ppm,
        residual=residual(stamps_ns, scans[-1].revolution),
        jitter=lidar.device_clock.jitter,
        latest=max(scan.late for scan in scans),
        latency=float(np.median(arrivals_ns - stamps_ns)) * 1e-9,
    )


def _duration(scans: Sequence[Scan]) -> float:
    """Return the time from the first to the last scan [s]; 0 for one scan."""
    return (scans[-1].stamp_ns - scans[0].stamp_ns) * 1e-9
