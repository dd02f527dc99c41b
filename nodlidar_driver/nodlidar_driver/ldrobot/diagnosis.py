"""What the driver reports about an LD06 or LD19 and its scans."""

from collections import Counter
import math

from nodlidar_common.ldrobot import ROTATION_RATE
from nodlidar_driver.base.diagnosis import LidarDiagnosis
from nodlidar_driver.base.state import Link
from nodlidar_driver.ldrobot.lidar import LdrobotLidar, LdrobotScan


class LdrobotDiagnosis(LidarDiagnosis):
    """Reports the state of an LD06 or LD19."""

    def __init__(self) -> None:
        super().__init__()
        self._before: Counter[str] = Counter()  # lost in former connections

    def disconnected(self) -> None:
        """Report only the counts until connected again."""
        self._before = self.lost()
        super().disconnected()

    def lost(self) -> Counter[str]:
        """Return what was lost so far, by name; a new object."""
        return self._before + (Counter() if self._lidar is None else self._lidar.lost)

    def link_to(self, lidar: LdrobotLidar) -> Link:
        """Return how the clock of a connected lidar runs."""
        return Link(lidar.arrivals.drift_ppm, lidar.arrivals.jitter)

    def expected_rate(self, link: Link) -> float:
        """Return how many scans per second the lidar should send."""
        return ROTATION_RATE

    def link_figures(self, link: Link, scan: LdrobotScan) -> dict[str, str]:
        """Return what the lidar is, and how its motor turns."""
        return {
            'Vendor Name': 'LDROBOT',
            'Motor speed': f'{1.0 / scan.revolution:.2f} Hz',
            'Uneven motor': f'{math.degrees(scan.uneven):.2f} deg',
        }
