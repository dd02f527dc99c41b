"""The lifecycle node of an LD06 or LD19: publishes its scans."""

import array
import math
import sys

from nodlidar_common.host_time import raw_ns
from nodlidar_common.ldrobot import RANGE_MM
from nodlidar_common.ros.node import run
from nodlidar_common.ros.steady import steady_ns
from nodlidar_driver.base.reader import READ_TIMEOUT, Reader
from nodlidar_driver.config import LdrobotConfig
from nodlidar_driver.ldrobot.diagnosis import LdrobotDiagnosis
from nodlidar_driver.ldrobot.lidar import LdrobotLidar, LdrobotScan
from nodlidar_driver.ros.lidar_node import LidarNode
from sensor_msgs.msg import LaserScan


class LdrobotNode(LidarNode):
    """Reads an LD06 or LD19."""

    def __init__(self) -> None:
        super().__init__(LdrobotConfig)

    def configure(self) -> None:
        """Restart the counts."""
        self.diagnosis = LdrobotDiagnosis()

    def connect(self) -> None:
        """Open the port, and wait for a scan."""
        config = self.config
        port = self.thread.open_port(READ_TIMEOUT)
        reader = Reader(port, raw_ns, config.timeout, self.thread.keep_going)
        window = config.angle_min, config.angle_max
        self._lidar = lidar = LdrobotLidar(reader, window, config.least_confidence)
        lidar.connect()
        self.diagnosis.connected(lidar, steady_ns())

    def message(self, scan: LdrobotScan) -> LaserScan:
        """Return the message of a scan, without its header."""
        least, greatest = RANGE_MM
        return LaserScan(
            angle_min=scan.azimuth,
            angle_max=scan.azimuth + scan.azimuth_step * (len(scan.ranges) - 1),
            angle_increment=scan.azimuth_step,
            time_increment=scan.revolution * abs(scan.azimuth_step) / math.tau,
            scan_time=scan.revolution,
            range_min=least / 1e3,
            range_max=greatest / 1e3,
            ranges=array.array('f', scan.ranges.tobytes()),
            intensities=array.array('f', scan.confidences.tobytes()),
        )


def main() -> None:
    """Run the driver node."""
    sys.exit(run(LdrobotNode))
