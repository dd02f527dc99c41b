"""What the device's thread passes on to the diagnostics."""

from collections.abc import Mapping
from dataclasses import dataclass, field
import math

from nodlidar_driver.identity import Capabilities, State, Version
from nodlidar_driver.lidar import Lidar


@dataclass(frozen=True, slots=True)
class Link:
    """A connected lidar: what it reports about itself, and how its clock runs."""

    version: Version
    capabilities: Capabilities
    state: State
    is_synchronised: bool
    drift_ppm: float
    jitter: float

    @classmethod
    def of(cls, lidar: Lidar) -> 'Link':
        """Return the present link to a lidar."""
        clock = lidar.device_clock
        return cls(
            lidar.version,
            lidar.capabilities,
            lidar.state,
            clock.synchronised,
            clock.drift_ppm,
            clock.jitter,
        )


@dataclass(frozen=True, slots=True)
class LidarState:
    """The lidar and its scans so far, as the device's thread passes them on.

    Attributes
    ----------
    link
        The connected lidar; None without one.
    heard_ns
        Time of the latest scan, or else of the connection [ns].
    latency
        Time from the first beam of the latest scan to its arrival [s]; NaN before the first scan.
    published, lost
        Scans published, and lost by reason, over all connections.
    scans, late_scans
        Scans that were dated, and those of them that were late.
    lateness
        Lateness of the latest scans [s].
    clock_steps, last_clock_step
        How often the host's clock was set, and by how much it was last [s].
    """

    link: Link | None = None
    heard_ns: int = 0
    latency: float = math.nan
    published: int = 0
    lost: Mapping[str, int] = field(default_factory=dict)
    scans: int = 0
    late_scans: int = 0
    lateness: tuple[float, ...] = ()
    clock_steps: int = 0
    last_clock_step: float = 0.0
