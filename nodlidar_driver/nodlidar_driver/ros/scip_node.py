"""The lifecycle node of a Hokuyo lidar: publishes its scans."""

import array
import sys

from nodlidar_common.host_time import raw_ns
from nodlidar_common.ros.node import run
from nodlidar_common.ros.steady import steady_ns
from nodlidar_driver.base.reader import READ_TIMEOUT
from nodlidar_driver.config import ScipConfig
from nodlidar_driver.ros.lidar_node import LidarNode
from nodlidar_driver.scip.diagnosis import ScipDiagnosis
from nodlidar_driver.scip.lidar import Lidar, Scan
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scip_answer import STOP
from nodlidar_driver.scip.scip_port import ScipPort
from sensor_msgs.msg import LaserScan


class ScipNode(LidarNode):
    """Reads a Hokuyo lidar of SCIP 2.0."""

    def __init__(self) -> None:
        super().__init__(ScipConfig)

    def configure(self) -> None:
        """Restart the counts."""
        self._account = ScanAccount()
        self.diagnosis = ScipDiagnosis(self.config.skip, self._account)

    def connect(self) -> None:
        """Open the port and start the stream."""
        config = self.config
        port = self.thread.open_port(READ_TIMEOUT, STOP)
        scip = ScipPort(port, raw_ns, config.timeout, self.thread.keep_going)
        self._lidar = lidar = Lidar(scip, config.window, self._account)
        lidar.connect()
        self.diagnosis.connected(lidar, steady_ns())

    def message(self, scan: Scan) -> LaserScan:
        """Return the message of a scan, without its header."""
        window, capabilities = self._lidar.window, self._lidar.capabilities
        return LaserScan(
            angle_min=window.angle_min,
            angle_max=window.angle_max,
            angle_increment=window.angle_increment,
            time_increment=scan.revolution / window.steps_per_revolution * window.cluster,
            scan_time=scan.revolution * (window.skip + 1),
            range_min=capabilities.range_min,
            range_max=capabilities.range_max,
            ranges=array.array('f', scan.ranges.tobytes()),
        )


def main() -> None:
    """Run the driver node."""
    sys.exit(run(ScipNode))
