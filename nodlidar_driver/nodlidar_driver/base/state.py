"""What the device's thread passes on to the diagnostics."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Link:
    """What is known of a connected lidar; the drivers add to it."""

    drift_ppm: float  # of its clock
    jitter: float  # s


@dataclass(frozen=True, slots=True)
class LidarState:
    """The lidar and its scans so far; counts are over all connections."""

    link: Any = None  # a Link; None while not connected
    heard_ns: int = 0  # time of the latest scan, or else of the connection
    scan: Any = None  # the latest of this connection
    scans: int = 0  # that were published
    lost: Counter[str] = field(default_factory=Counter)  # by name; a copy that nobody changes
    late_scans: int = 0
    lateness: tuple[float, ...] = ()  # s, of the latest scans
    clock_steps: int = 0  # of the host's clock
    last_clock_step: float = 0.0  # s
