"""The lidar's lifecycle node: keeps it connected and publishes its scans."""

import sys

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from nodlidar_common.errors import DeviceError
from nodlidar_common.host_time import HostTime
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.node import run
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.serial_port import close_port, open_port
from nodlidar_driver.config import DriverConfig
from nodlidar_driver.diagnosis import Diagnosis
from nodlidar_driver.lidar import Lidar
from nodlidar_driver.ros.messages import arrival_message, fill_scan, scan_template
from nodlidar_driver.scip_answer import STOP
from nodlidar_driver.scip_port import READ_TIMEOUT
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import LaserScan, TimeReference
import serial

_DEPTH = 100  # scans kept for a reliable subscriber that stands still for some seconds


class Driver(DeviceNode):
    """Reads a Hokuyo URG-04LX-UG01 and publishes `scan` and `~/arrival`."""

    def __init__(self) -> None:
        super().__init__('driver', DriverConfig)
        self._host_time = HostTime()
        self.configure()
        self._port: serial.Serial | None = None
        self._lidar: Lidar | None = None
        self._laser_trouble = ''
        overridable = QoSOverridingOptions.with_default_policies()
        profile = QoSProfile(depth=_DEPTH)
        self._scans = self.create_lifecycle_publisher(
            LaserScan, 'scan', profile, qos_overriding_options=overridable
        )
        self._arrivals = self.create_lifecycle_publisher(
            TimeReference, '~/arrival', profile, qos_overriding_options=overridable
        )

    def configure(self) -> None:
        """Choose the beams."""
        self._window = self.config.window()
        self._diagnosis = Diagnosis(self._window, self._host_time)

    def connect(self) -> None:
        """Open the port and bring the lidar to streaming."""
        config = self.config
        self._port = open_port(config.port, config.baud_rate, READ_TIMEOUT)
        self.guard(self._port.fileno(), STOP)
        self._lidar = Lidar(
            self._port,
            self._window,
            steady_ns,
            config.timeout,
            self._diagnosis.account,
            self.keep_going,
        )
        self._lidar.start()
        self._laser_trouble = ''
        self._message = scan_template(self._window, config.frame_id, self._lidar.capabilities)
        self._diagnosis.connected(self._lidar, steady_ns())

    def cycle(self) -> None:
        """Publish one scan."""
        assert self._lidar is not None
        scan = self._lidar.read()
        self._host_time.look()
        ahead_ns = self._host_time.ahead_ns
        stamp_ns = scan.stamp_ns + ahead_ns + round(self.config.stamp_offset * NS_PER_S)
        fill_scan(self._message, self._window, stamp_ns, scan.rotation, scan.ranges)
        self._scans.publish(self._message)
        self._arrivals.publish(arrival_message(self._message, scan.arrival_ns + ahead_ns))
        self._diagnosis.published(scan)

    def disconnect(self) -> None:
        """Turn the laser off and close the port, as far as either is still possible."""
        lidar, self._lidar = self._lidar, None
        port, self._port = self._port, None
        self._diagnosis.disconnected()
        if lidar is not None:
            try:
                lidar.stop()
            except DeviceError as error:
                self._tell_laser(str(error))
        if port is not None:
            close_port(port)

    def _tell_laser(self, trouble: str) -> None:
        """Log once in each row of failures that the laser may be on."""
        if trouble != self._laser_trouble:
            self.get_logger().error(f'the laser may be on: {trouble}')
        self._laser_trouble = trouble

    def urgent(self) -> object:
        """Return what the diagnostics tell at once: silence, and what was lost or set."""
        return self._diagnosis.urgent(steady_ns())

    def diagnose(self, status: DiagnosticStatusWrapper) -> None:
        """Add the lidar's identity, rates, losses and clock; a warning for each new trouble."""
        report = self._diagnosis.report(steady_ns())
        for warning in report.warnings:
            status.mergeSummary(DiagnosticStatus.WARN, warning)
        if (publishers := self.count_publishers(self._scans.topic_name)) > 1:
            others = f'{publishers} publishers on {self._scans.topic_name}: stop all but one'
            status.mergeSummary(DiagnosticStatus.WARN, others)
        for name, value in report.figures.items():
            status.add(name, value)


def main() -> None:
    """Run the driver node."""
    sys.exit(run(Driver))
