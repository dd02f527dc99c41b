"""What the driver of Hokuyo lidars reports about the lidar and its scans."""

from collections import Counter
from dataclasses import dataclass, replace

from nodlidar_common.report import Report
from nodlidar_driver.base.diagnosis import LidarDiagnosis
from nodlidar_driver.base.state import Link
from nodlidar_driver.scip.identity import Capabilities, State, Version
from nodlidar_driver.scip.lidar import Lidar, Scan
from nodlidar_driver.scip.scan_account import MISSED, ScanAccount, SETTLING

_DRIFT_WARNING_PPM = 450.0  # beyond this the drift may leave the range of the estimate
_DROPPED = 'Scans dropped: '


@dataclass(frozen=True, slots=True)
class ScipLink(Link):
    """What a connected lidar reports about itself, and how its clock runs."""

    version: Version
    capabilities: Capabilities
    state: State
    is_synchronised: bool


class ScipDiagnosis(LidarDiagnosis):
    """Reports the state of a Hokuyo lidar.

    Parameters
    ----------
    skip
        Scans left out after each sent one.
    account
        Counts the scans; read in the device's thread only.
    """

    usual = _DROPPED + SETTLING  # each stream begins so

    def __init__(self, skip: int, account: ScanAccount) -> None:
        super().__init__()
        self._periods, self._account = 1 + skip, account

    def lost(self) -> Counter[str]:
        """Return the scans lost so far, by name; a new object."""
        lost = self._account.lost
        return Counter(
            {'Scans missed' if name == MISSED else _DROPPED + name: lost[name] for name in lost}
        )

    def link_to(self, lidar: Lidar) -> ScipLink:
        """Return what is known of a connected lidar."""
        clock, identity = lidar.device_clock, (lidar.version, lidar.capabilities, lidar.state)
        return ScipLink(clock.drift_ppm, clock.jitter, *identity, clock.synchronised)

    def next_report(self, now_ns: int) -> Report:
        """Return the state, with the scans that were due."""
        report, state = super().next_report(now_ns), self._reported
        due = str(state.scans + state.lost.total())
        return replace(report, figures={**report.figures, 'Scans due': due})

    def expected_rate(self, link: ScipLink) -> float:
        """Return how many scans per second the lidar should send."""
        return 1.0 / (link.capabilities.revolution * self._periods)

    def link_warnings(self, link: ScipLink) -> list[str]:
        """Return what is unusual about the lidar's clock."""
        warnings = []
        if not link.is_synchronised:
            warnings.append('no usable answers in time mode: stamps may be off by some 10 ms')
        if abs(link.drift_ppm) > _DRIFT_WARNING_PPM:
            warnings.append(f'clock drift {link.drift_ppm:.0f} ppm')
        return warnings

    def link_figures(self, link: ScipLink, scan: Scan) -> dict[str, str]:
        """Return what the lidar reports about itself."""
        return {
            'Vendor Name': link.version.vendor,
            'Product Name': link.version.product,
            'Firmware Version': link.version.firmware,
            'Protocol Version': link.version.protocol,
            'Device ID': link.version.serial_number,
            'Device Status': link.state.health,
            'Motor speed': link.state.speed,
        }
