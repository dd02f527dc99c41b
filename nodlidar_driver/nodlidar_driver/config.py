"""The driver's parameters."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_driver.scan import scan_window, ScanWindow

_ROTATION = 0.1  # s, nominal: a scan comes in each, but for those that are skipped


@dataclass(frozen=True, slots=True)
class DriverConfig:
    """Parameters of the driver node; see config/driver.yaml."""

    port: str = parameter('/dev/ttyACM0', "The lidar's serial port")
    baud_rate: int = parameter(
        115200, 'Bit rate of an RS-232 port; without effect over USB', unit='bit/s', minimum=9600
    )
    frame_id: str = parameter('laser', 'Frame of the scans: origin at the optical centre')
    angle_min: float = parameter(
        -2.0862, 'Azimuth of the first beam', unit='rad', minimum=-2.0863, maximum=2.0925
    )
    angle_max: float = parameter(
        2.0924, 'Azimuth of the last beam', unit='rad', minimum=-2.0863, maximum=2.0925
    )
    cluster: int = parameter(
        1, 'Neighbouring beams that share one value, their least range', minimum=1, maximum=99
    )
    skip: int = parameter(0, 'Scans left out after each published one', minimum=0, maximum=9)
    stamp_offset: float = parameter(
        0.0, 'Added to the time stamps', unit='s', minimum=-1.0, maximum=1.0, live=True
    )
    timeout: float = parameter(
        1.0, 'Silence after which the lidar is connected anew', unit='s', minimum=0.3, maximum=5.0
    )
    reconnect_delay: float = parameter(
        0.5, 'Wait before connecting anew', unit='s', minimum=0.1, maximum=60.0
    )
    autostart: bool = parameter(
        False, 'Configure and activate at start, without waiting to be told'
    )

    def check_together(self) -> None:
        """Raise ParameterError if the window holds no cluster or the timeout no two scans."""
        self.window()
        least = round(2 * (self.skip + 1) * _ROTATION, 1)
        if self.timeout < least:
            limit = f'at least {least} s, the time of two scans with skip = {self.skip}'
            raise ParameterError('timeout', limit, self.timeout)

    def window(self) -> ScanWindow:
        """Return the beams that are asked for."""
        return scan_window(self.angle_min, self.angle_max, self.cluster, self.skip)
