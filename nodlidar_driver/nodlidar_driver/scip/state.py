"""What the device's thread passes on to the diagnostics."""

from dataclasses import dataclass
import math

from nodlidar_driver.scip.identity import Capabilities, State, Version
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scan_account import ScanAccount


@dataclass(frozen=True, slots=True)
class Link:
    """A connected lidar: what it reports about itself, and how its clock runs."""

    version: Version
    capabilities: Capabilities
    state: State
    is_synchronised: bool
    drift_ppm: float
    jitter: float  # s

    @classmethod
    def of(cls, lidar: Lidar) -> 'Link':
        """Return the present link to a lidar."""
        clock, identity = lidar.device_clock, (lidar.version, lidar.capabilities, lidar.state)
        return cls(*identity, clock.synchronised, clock.drift_ppm, clock.jitter)


@dataclass(frozen=True, slots=True)
class LidarState:
    """The lidar and its scans so far; counts are over all connections."""

    account: ScanAccount  # a copy that nobody changes
    link: Link | None = None  # None while not connected
    heard_ns: int = 0  # time of the latest scan, or else of the connection
    latency: float = math.nan  # s, from first beam to arrival of the latest scan
    scans: int = 0  # dated scans
    late_scans: int = 0
    lateness: tuple[float, ...] = ()  # s, of the latest scans
    clock_steps: int = 0  # of the host's clock
    last_clock_step: float = 0.0  # s
