"""The parameters of the drivers."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.ldrobot import BIT_RATE
from nodlidar_common.parameters import parameter
from nodlidar_driver.scip.identity import Capabilities
from nodlidar_driver.scip.scan_window import scan_window, ScanWindow

_REVOLUTION = 0.1  # s, nominal time of one scan, sent or skipped


@dataclass(frozen=True, slots=True)
class _ScansConfig:
    """Scans and their node."""

    frame_id: str = parameter(
        'laser', 'Frame of the scans: origin at the optical centre, x forward, z up'
    )
    angle_min: float = parameter(
        -3.1416,
        'Least azimuth of a scan, rounded to a whole beam; what the lidar does not measure is '
        'left out',
        unit='rad',
        minimum=-3.1416,
        maximum=3.1416,
    )
    angle_max: float = parameter(
        3.1416,
        'Greatest azimuth of a scan, rounded to a whole beam; what the lidar does not measure is '
        'left out',
        unit='rad',
        minimum=-3.1416,
        maximum=3.1416,
    )
    stamp_offset: float = parameter(
        0.0, 'Time to add to the stamps', unit='s', minimum=-1.0, maximum=1.0, live=True
    )
    reconnect_delay: float = parameter(
        0.5, 'Wait before reconnecting', unit='s', minimum=0.1, maximum=60.0
    )
    autostart: bool = parameter(False, 'Configure and activate the node at start')

    def check_together(self) -> None:
        """Raise ParameterError if the window is empty."""
        if self.angle_max <= self.angle_min:
            limit = f'above angle_min = {self.angle_min}'
            raise ParameterError('angle_max', limit, self.angle_max)


@dataclass(frozen=True, slots=True)
class ScipConfig(_ScansConfig):
    """Lidar."""

    port: str = parameter(
        '/dev/ttyACM0',
        'Serial port of the lidar, or tcp://ADDRESS:PORT, 10940 by default; with two lidars use '
        'the stable names in /dev/serial/by-id',
    )
    baud_rate: int = parameter(
        115200,
        'Bit rate of an RS-232 port (a whole scan at 10 Hz needs USB); no effect over USB',
        unit='bit/s',
        minimum=9600,
        maximum=4_000_000,
    )
    cluster: int = parameter(
        1,
        'Neighbouring beams that share one value, the least of their ranges',
        minimum=1,
        maximum=99,
    )
    skip: int = parameter(0, 'Scans to leave out after each published one', minimum=0, maximum=9)
    timeout: float = parameter(
        1.0,
        'Silence after which the lidar is reconnected; at least 0.2 s for each of skip + 1 scans',
        unit='s',
        minimum=0.3,
        maximum=5.0,
    )

    def check_together(self) -> None:
        """Raise ParameterError if the timeout is below two scans."""
        least = round(2 * (self.skip + 1) * _REVOLUTION, 1)
        if self.timeout < least:
            limit = f'at least {least} s, the time of two scans with skip = {self.skip}'
            raise ParameterError('timeout', limit, self.timeout)

    def window(self, lidar: Capabilities) -> ScanWindow:
        """Return the requested beams of a lidar; DeviceError if it measures none of them."""
        return scan_window(self.angle_min, self.angle_max, self.cluster, self.skip, lidar)


@dataclass(frozen=True, slots=True)
class LdrobotConfig(_ScansConfig):
    """Lidar."""

    port: str = parameter(
        '/dev/ttyUSB0',
        'Serial port of the lidar; a servo may take this name: use those in /dev/serial/by-id',
    )
    baud_rate: int = parameter(
        BIT_RATE, 'Bit rate of the port', unit='bit/s', minimum=9600, maximum=4_000_000
    )
    least_confidence: int = parameter(
        16,
        "Least confidence of a range, else it is NaN; LDROBOT's own driver drops groups of 15 or "
        'less near by',
        minimum=0,
        maximum=255,
    )
    timeout: float = parameter(
        1.0, 'Silence after which the lidar is reconnected', unit='s', minimum=0.3, maximum=5.0
    )
