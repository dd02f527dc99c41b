"""The lidar's lifecycle node: keeps it connected and publishes its scans."""

import contextlib
import sys
import time

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from nodlidar_common.device_node import DeviceNode
from nodlidar_common.errors import DeviceError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.node import run
from nodlidar_common.serial_port import close_port, open_port
from nodlidar_driver.config import DriverConfig
from nodlidar_driver.diagnosis import Diagnosis
from nodlidar_driver.lidar import Lidar
from nodlidar_driver.messages import arrival_message, fill_scan, scan_template
from nodlidar_driver.scip_client import STOP
from nodlidar_driver.scip_port import READ_TIMEOUT
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import LaserScan, TimeReference
import serial


class Driver(DeviceNode):
    """Reads a Hokuyo URG-04LX-UG01 and publishes `scan` and `~/arrival`."""

    def __init__(self) -> None:
        super().__init__('driver', DriverConfig)
        self.configure()
        self._port: serial.Serial | None = None
        self._lidar: Lidar | None = None
        overridable = QoSOverridingOptions.with_default_policies()
        self._scans = self.create_lifecycle_publisher(
            LaserScan, 'scan', QoSProfile(depth=10), qos_overriding_options=overridable
        )
        self._arrivals = self.create_lifecycle_publisher(
            TimeReference, '~/arrival', QoSProfile(depth=10), qos_overriding_options=overridable
        )

    def configure(self) -> None:
        """Choose the beams."""
        self._window = self.config.window()
        self._diagnosis = Diagnosis(self._window)

    def connect(self) -> None:
        """Open the port and bring the lidar to streaming."""
        config = self.config
        self._port = open_port(config.port, config.baud_rate, READ_TIMEOUT)
        self.guard(self._port.fileno(), STOP)
        self._lidar = Lidar(
            self._port, self._window, time.time_ns, config.timeout, self.keep_going
        )
        self._lidar.start()
        self._message = scan_template(self._window, config.frame_id, self._lidar.capabilities)
        self._diagnosis.connected(self._lidar)

    def cycle(self) -> None:
        """Publish one scan."""
        assert self._lidar is not None
        scan = self._lidar.read()
        stamp_ns = scan.stamp_ns + round(self.config.stamp_offset * NS_PER_S)
        fill_scan(self._message, self._window, stamp_ns, scan.rotation, scan.ranges)
        self._scans.publish(self._message)
        self._arrivals.publish(arrival_message(self._message, scan.arrival_ns))
        self._diagnosis.published(scan)

    def disconnect(self) -> None:
        """Turn the laser off and close the port, as far as either is still possible."""
        lidar, self._lidar = self._lidar, None
        port, self._port = self._port, None
        self._diagnosis.disconnected()
        if lidar is not None:
            with contextlib.suppress(DeviceError):
                lidar.stop()
        if port is not None:
            close_port(port)

    def diagnose(self, status: DiagnosticStatusWrapper) -> None:
        """Add the lidar's identity, rates, losses and clock; a warning for each new trouble."""
        report = self._diagnosis.report(time.monotonic_ns())
        for warning in report.warnings:
            status.mergeSummary(DiagnosticStatus.WARN, warning)
        for name, value in report.figures.items():
            status.add(name, value)


def main() -> None:
    """Run the driver node."""
    sys.exit(run(Driver))
