"""The lifecycle node of the lidar: publishes its scans."""

from dataclasses import replace
import sys

from nodlidar_common.host_time import even_ns, HostTime, SteadyTime
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.node import run
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_driver.config import DriverConfig
from nodlidar_driver.diagnosis import Diagnosis
from nodlidar_driver.lidar import Lidar, Scan
from nodlidar_driver.ros.messages import arrival_message, fill_scan, scan_template
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scip_answer import STOP
from nodlidar_driver.scip.scip_port import READ_TIMEOUT
import numpy as np
from rclpy.qos import QoSProfile
from sensor_msgs.msg import LaserScan, TimeReference

_DEPTH = 100  # scans kept for a reliable subscriber that pauses for some seconds


class DriverNode(DeviceNode):
    """Reads a Hokuyo lidar of SCIP 2.0 and publishes `scan` and `~/arrival`."""

    def __init__(self) -> None:
        super().__init__('driver', DriverConfig)
        self._host_time, self._steady_time = HostTime(), SteadyTime()
        self.configure()
        self._lidar: Lidar | None = None
        self._scans = self.create_lifecycle_publisher(
            LaserScan, 'scan', QoSProfile(depth=_DEPTH), qos_overriding_options=OVERRIDABLE
        )
        self.sole_topic = self._scans.topic_name
        self._arrivals = self.create_lifecycle_publisher(
            TimeReference,
            '~/arrival',
            QoSProfile(depth=_DEPTH),
            qos_overriding_options=OVERRIDABLE,
        )

    def configure(self) -> None:
        """Restart the counts."""
        self._account = ScanAccount()
        self.diagnosis: Diagnosis = Diagnosis(self.config.skip, self._account)

    def connect(self) -> None:
        """Open the port and start the stream."""
        config = self.config
        self._lidar = lidar = Lidar(
            self.thread.open_port(READ_TIMEOUT, STOP),
            config.window,
            even_ns,
            config.timeout,
            self._account,
            self.thread.keep_going,
        )
        lidar.connect()
        self._message = scan_template(lidar.window, config.frame_id, lidar.capabilities)
        self.diagnosis.connected(lidar, steady_ns())

    def cycle(self) -> None:
        """Publish one scan."""
        assert self._lidar is not None
        scan = self._on_steady_clock(self._lidar.read())
        self.diagnosis.clock_set(self._host_time.update())
        ahead_ns = self._host_time.ahead_ns
        stamp_ns = scan.stamp_ns + ahead_ns + round(self.config.stamp_offset * NS_PER_S)
        fill_scan(self._message, self._lidar.window, stamp_ns, scan.revolution, scan.ranges)
        self._scans.publish(self._message)
        self._arrivals.publish(arrival_message(self._message, scan.arrival_ns + ahead_ns))
        self.diagnosis.published(scan)

    def _on_steady_clock(self, scan: Scan) -> Scan:
        """Return a scan that was dated by the even clock with its times on the steady clock."""
        self._steady_time.update()
        before_ns = scan.arrival_ns - round(scan.revolution * NS_PER_S)
        times_ns = np.array([scan.stamp_ns, before_ns, scan.arrival_ns])
        stamp_ns, before_ns, arrival_ns = self._steady_time(times_ns).tolist()
        revolution = (arrival_ns - before_ns) / NS_PER_S
        return replace(scan, stamp_ns=stamp_ns, revolution=revolution, arrival_ns=arrival_ns)

    def disconnect(self) -> None:
        """Turn the laser off."""
        lidar, self._lidar = self._lidar, None
        try:
            if lidar is not None:
                lidar.disconnect()
        finally:
            self.diagnosis.disconnected()


def main() -> None:
    """Run the driver node."""
    sys.exit(run(DriverNode))
