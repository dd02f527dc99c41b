"""Base class of the drivers' nodes: dates the scans by the host's clock and publishes them."""

from dataclasses import replace
from typing import Any

from nodlidar_common.host_time import HostTime, SteadyTime
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.stamps import NS_PER_S
from nodlidar_driver.base.diagnosis import LidarDiagnosis
import numpy as np
from sensor_msgs.msg import LaserScan, TimeReference

_DEPTH = 100  # scans kept for a reliable subscriber that pauses for some seconds


class LidarNode(DeviceNode):
    """Publishes the scans of a lidar on `scan`, and when they arrived on `~/arrival`.

    Subclasses set `diagnosis` in `configure`; in `connect` they set `_lidar`, whose scans are
    dated by :func:`.raw_ns`, and call the diagnosis.
    """

    diagnosis: LidarDiagnosis

    def __init__(self, config_class: type[Any]) -> None:
        super().__init__('driver', config_class)
        self._host_time, self._steady_time = HostTime(), SteadyTime()
        self.configure()
        self._lidar: Any = None
        self._scans = self.create_lifecycle_publisher(
            LaserScan, 'scan', _DEPTH, qos_overriding_options=OVERRIDABLE
        )
        self.sole_topic = self._scans.topic_name
        self._arrivals = self.create_lifecycle_publisher(
            TimeReference, '~/arrival', _DEPTH, qos_overriding_options=OVERRIDABLE
        )

    def message(self, scan: Any) -> LaserScan:
        """Return the message of a scan, without its header."""
        raise NotImplementedError

    def cycle(self) -> None:
        """Publish one scan, and its arrival if anyone listens."""
        scan = self._on_steady_clock(self._lidar.read())
        self.diagnosis.clock_set(self._host_time.update())
        ahead_ns = self._host_time.ahead_ns
        stamp_ns = scan.stamp_ns + ahead_ns + round(self.config.stamp_offset * NS_PER_S)
        message = self.message(scan)
        self._publish(self._scans, message, stamp_ns)
        if self._arrivals.get_subscription_count():
            arrival = TimeReference(time_ref=message.header.stamp, source='last byte')
            self._publish(self._arrivals, arrival, scan.arrival_ns + ahead_ns)
        self.diagnosis.published(scan)

    def _publish(self, publisher: Any, message: Any, stamp_ns: int) -> None:
        header = message.header
        header.stamp, header.frame_id = time_message(stamp_ns), self.config.frame_id
        publisher.publish(message)

    def _on_steady_clock(self, scan: Any) -> Any:
        """Return a scan that was dated by the raw clock with its times on the steady clock."""
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
