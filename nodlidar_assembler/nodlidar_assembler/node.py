"""The assembler node: scans and joint states in, point clouds and the nod command out."""

import sys
from typing import Any

from message_filters import Subscriber
from nodlidar_assembler.cloud_frames import CloudFrames
from nodlidar_assembler.cloud_message import cloud_message
from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.surroundings import Surroundings
from nodlidar_assembler.coverage_report import CoverageReport
from nodlidar_assembler.diagnosis import Diagnosis
from nodlidar_assembler.filters.scan_filter import ScanFilter
from nodlidar_assembler.filters.scan_to_cloud import ScanToCloud
from nodlidar_assembler.nod_commander import NodCommander
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_assembler.tf_odometry import TfOdometry
from nodlidar_common.node import run
from nodlidar_common.node_parameters import declare
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState, LaserScan, PointCloud2


class Assembler(Node):
    """Gives every beam of each scan its own pose and publishes the points."""

    def __init__(self) -> None:
        super().__init__('assembler')
        profile = PROFILES[declare(self, ProfileConfig).profile]
        self.config = declare(self, AssemblerConfig, self._reconfigure, profile)
        self._nod = NodCommander(self, self.config) if self.config.command_nod else None
        self._surroundings = Surroundings(self.config)
        self._clouds = self.create_publisher(
            PointCloud2,
            'points',
            QoSProfile(depth=10),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._to_cloud = self._make_way()
        self._diagnosis = Diagnosis(self, self.config.scan_timeout, self._to_cloud)
        if self.config.coverage_window > 0.0:
            CoverageReport(
                self, self._diagnosis.updater, self.config, self._surroundings.covered, self._nod
            )

    def _make_way(self) -> ScanToCloud:
        """Return what makes clouds of messages, with all its inputs."""
        config = self.config
        scans = ScanFilter(
            self._subscriber(LaserScan, 'scan', 10),
            config,
            lambda reason: self._to_cloud.drop(reason),
        )
        scans.registerCallback(self._scan_arrived)
        odometry = None
        if config.ego_motion != 'off':
            odometry = TfOdometry(self, config.odom_frame, config.frame_id)
            self._frames = CloudFrames(self, config.odom_frame)
        return ScanToCloud(
            config,
            scans,
            self._subscriber(JointState, 'joint_states', 50),
            odometry,
            self._now_ns,
            self._made,
            lambda text: self.get_logger().warning(text, throttle_duration_sec=5.0),
        )

    def _subscriber(self, kind: Any, topic: str, depth: int) -> Subscriber:
        return Subscriber(
            self,
            kind,
            topic,
            qos_profile=QoSProfile(depth=depth),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _scan_arrived(self, scan: LaserScan) -> None:
        self._diagnosis.scan_arrived(self._now_ns(), len(scan.ranges))
        if self._nod is not None:
            self._nod.follow_lidar(scan)

    def _made(self, scan: Scan, clouds: list[Points], odometry: Odometry | None) -> None:
        """Publish clouds, then choose the nod by what was covered and what is around."""
        for cloud in clouds:
            frame_id = self.config.frame_id if odometry is None else self._frames.frame(cloud)
            self._clouds.publish(cloud_message(cloud, frame_id))
            self._diagnosis.cloud_published(self._now_ns(), cloud)
        beams, pitch = self._to_cloud.pipeline.beams(scan.geometry), self._to_cloud.pipeline.pitch
        self._surroundings.add_scan(scan, beams, pitch)
        shape = None
        if self.config.adapt_limits:
            self._surroundings.follow(scan, beams, pitch, odometry)
            shape = self._surroundings.shape()
        if self._nod is not None:
            self._nod.adapt(shape, scan, beams, pitch)

    def _reconfigure(self, config: AssemblerConfig) -> None:
        if config.adapt_limits and not self.config.adapt_limits:
            self._surroundings.restart_limits()  # so that the limits set out from the present ones
        self.config = config


def main() -> None:
    """Run the assembler node."""
    sys.exit(run(Assembler))
