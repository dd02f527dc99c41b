"""The assembler node: scans and joint states in, point clouds and the nod command out."""

import math
import sys

from message_filters import Subscriber
from nodlidar_assembler.assembly import Points
from nodlidar_assembler.bracket_filter import BracketFilter
from nodlidar_assembler.cloud_frames import CloudFrames
from nodlidar_assembler.cloud_message import cloud_message
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.coverage_report import CoverageReport
from nodlidar_assembler.diagnosis import Diagnosis
from nodlidar_assembler.ego_motion import Odometry, OdometryError
from nodlidar_assembler.geometry import Beams
from nodlidar_assembler.joint_filter import JointFilter
from nodlidar_assembler.joint_history import JointSamples
from nodlidar_assembler.nod_clock import NodShape
from nodlidar_assembler.nod_controller import NodController
from nodlidar_assembler.odometry_filter import OdometryFilter
from nodlidar_assembler.pipeline import Pipeline, Scan
from nodlidar_assembler.pitch import PitchError
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_assembler.scan_filter import ScanFilter
from nodlidar_assembler.scan_message import geometry_from_message, scan_from_message
from nodlidar_assembler.surroundings import Surroundings
from nodlidar_assembler.tf_odometry import TfOdometry
from nodlidar_common.errors import ParameterError
from nodlidar_common.messages import nod_to_message
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.node import run
from nodlidar_common.node_parameters import declare
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand
import numpy as np
from numpy.typing import NDArray
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
        self._pipeline = Pipeline.configured(self.config)
        self._nod = NodController(self.config)
        self._warn_if_samples_repeat()
        self._surroundings = Surroundings(self.config)
        self._diagnosis = Diagnosis(self, self.config.scan_timeout)
        if self.config.coverage_window > 0.0:
            CoverageReport(
                self,
                self._diagnosis.updater,
                self.config,
                self._surroundings.covered,
                lambda: self._nod.round_time,
            )
        self._make_outputs()
        self._make_inputs()

    def _make_outputs(self) -> None:
        overridable = QoSOverridingOptions.with_default_policies()
        self._clouds = self.create_publisher(
            PointCloud2, 'points', QoSProfile(depth=10), qos_overriding_options=overridable
        )
        if self.config.command_nod:
            self._commands = self.create_publisher(
                NodCommand, 'nod_command', QoSProfile(depth=1), qos_overriding_options=overridable
            )
            self.create_timer(1.0 / self.config.command_rate, self._repeat_command)

    def _make_inputs(self) -> None:
        overridable = QoSOverridingOptions.with_default_policies()
        scans = ScanFilter(
            Subscriber(
                self,
                LaserScan,
                'scan',
                qos_profile=QoSProfile(depth=10),
                qos_overriding_options=overridable,
            ),
            self._drop,
        )
        states = Subscriber(
            self,
            JointState,
            'joint_states',
            qos_profile=QoSProfile(depth=50),
            qos_overriding_options=overridable,
        )
        scans.registerCallback(self._scan_arrived)
        joint = JointFilter(states, self.config, self._diagnosis.drops)
        joint.registerCallback(self._pipeline.add_sample)
        self._bracket(scans, joint)

    def _bracket(self, scans: ScanFilter, joint: JointFilter) -> None:
        bracket = BracketFilter(
            scans,
            joint,
            self._duration_ns,
            self.config.deadline,
            self._now_ns,
            lambda scan, reason: self._drop(reason),
            self._pipeline.estimator.margin_ns,
        )
        self.create_timer(self.config.deadline / 2.0, bracket.release)
        if self.config.ego_motion == 'off':
            bracket.registerCallback(self._assemble)
        else:
            self._add_odometry(bracket)

    def _add_odometry(self, bracket: BracketFilter) -> None:
        self._frames = CloudFrames(self, self.config.odom_frame)
        self._tf = TfOdometry(self, self.config.odom_frame, self.config.frame_id)
        with_odometry = OdometryFilter(
            bracket,
            self._tf.history,
            self._duration_ns,
            self.config.deadline,
            self._now_ns,
            self._odometry_missing,
        )
        self._tf.register(with_odometry.release, with_odometry.forget)
        with_odometry.registerCallback(self._assemble)
        self.create_timer(self.config.deadline / 2.0, with_odometry.release)

    def _duration_ns(self, scan: LaserScan) -> int:
        return self._pipeline.beams(geometry_from_message(scan)).duration_ns

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    # From a scan to its cloud.

    def _scan_arrived(self, scan: LaserScan) -> None:
        self._diagnosis.scan_arrived(self._now_ns(), len(scan.ranges))
        if self.config.command_nod:
            self._follow_lidar(scan)

    def _assemble(
        self, scan: LaserScan, samples: JointSamples, odometry: Odometry | None = None
    ) -> None:
        told = scan_from_message(scan)
        try:
            clouds = self._pipeline.add_scan(told, *samples, odometry)
        except PitchError as error:
            self._drop(str(error))
            return
        except OdometryError as error:
            self._odometry_missing(scan, samples, error.reason)
            return
        for reason, count in self._pipeline.estimator.fallbacks.items():
            self._diagnosis.counts[f'slerp instead of trajectory: {reason}'] = count
        for cloud in clouds:
            frame_id = self.config.frame_id if odometry is None else self._frames.frame(cloud)
            self._publish(cloud, frame_id)
        beams, pitch = self._pipeline.beams(told.geometry), self._pipeline.pitch
        self._look_around(told, beams, pitch, odometry)

    def _look_around(
        self, scan: Scan, beams: Beams, pitch: NDArray[np.float64], odometry: Odometry | None
    ) -> None:
        """Keep up what was covered and what is around, and choose the nod by it."""
        self._surroundings.add_scan(scan, beams, pitch)
        if self.config.adapt_limits:
            self._surroundings.follow(scan, beams, pitch, odometry)
        if self.config.command_nod:
            self._adapt(scan, beams, pitch)

    def _odometry_missing(self, scan: LaserScan, samples: JointSamples, reason: str) -> None:
        if self._tf.trouble:
            self.get_logger().warning(f'TF: {self._tf.trouble}', throttle_duration_sec=5.0)
        if self.config.without_odometry == 'drop':
            self._drop(reason)
            return
        self._diagnosis.counts[f'uncompensated: {reason}'] += 1
        self.get_logger().warning(f'motion not compensated: {reason}', throttle_duration_sec=5.0)
        self._assemble(scan, samples)

    def _publish(self, cloud: Points, frame_id: str) -> None:
        self._clouds.publish(cloud_message(cloud, frame_id))
        self._diagnosis.cloud_published(self._now_ns(), cloud)

    def _drop(self, reason: str) -> None:
        self._diagnosis.drops[reason] += 1
        self.get_logger().warning(f'scan dropped: {reason}', throttle_duration_sec=5.0)

    # The nod.

    def _warn_if_samples_repeat(self) -> None:
        divisor = math.gcd(self.config.samples_per_sweep, self.config.steps_per_revolution)
        if divisor > 1:
            self.get_logger().warning(
                f'samples_per_sweep = {self.config.samples_per_sweep} and steps_per_revolution = '
                f'{self.config.steps_per_revolution} share the divisor {divisor}: samples repeat'
            )

    def _follow_lidar(self, scan: LaserScan) -> None:
        """Keep the nod tied to the lidar's revolutions; its first command goes out at once."""
        first = self._nod.command is None
        try:
            self._nod.add_scan(geometry_from_message(scan), time_ns(scan.header.stamp))
        except ParameterError as error:
            self.get_logger().error(f'no nod commanded: {error}', throttle_duration_sec=5.0)
        else:
            if first:
                self._repeat_command()

    def _repeat_command(self) -> None:
        """Publish the command, for as long as scans come: without them the servo shall let go."""
        now_ns = self._now_ns()
        timeout_ns = self.config.scan_timeout * NS_PER_S
        command = self._nod.command
        if command is not None and now_ns - self._diagnosis.last_scan_ns <= timeout_ns:
            nod, start_ns = command
            self._commands.publish(nod_to_message(nod, now_ns, self.config.frame_id, start_ns))

    def _adapt(self, scan: Scan, beams: Beams, pitch: NDArray[np.float64]) -> None:
        """Take the nod that goes with the surroundings, or what is configured."""
        shape = self._configured_shape()
        if self.config.adapt_limits:
            shape = self._surroundings.shape() or shape
        now_ns = self._now_ns()
        changed = self._nod.change(shape, now_ns)
        try:
            chosen = self._nod.saw(scan, beams, pitch, now_ns)
        except ParameterError as error:
            self.get_logger().error(f'no sweep chosen: {error}', throttle_duration_sec=5.0)
            chosen = False
        if changed or chosen:
            self._repeat_command()

    def _configured_shape(self) -> NodShape:
        config = self.config
        return NodShape(config.pitch_min, config.pitch_max, config.samples_per_sweep)

    def _reconfigure(self, config: AssemblerConfig) -> None:
        if config.adapt_limits and not self.config.adapt_limits:
            self._surroundings.restart()  # so that the limits set out from the present ones
        self.config = config


def main() -> None:
    """Run the assembler node."""
    sys.exit(run(Assembler))
