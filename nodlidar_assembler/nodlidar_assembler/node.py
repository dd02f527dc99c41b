"""The assembler node: scans and joint states in, point clouds and the nod command out."""

import sys

from message_filters import SimpleFilter
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
from nodlidar_assembler.host_clock import HostClock, SETTLING_NS
from nodlidar_assembler.inputs import Input
from nodlidar_assembler.nod_commander import NodCommander
from nodlidar_assembler.profiles import ProfileConfig, PROFILES
from nodlidar_assembler.tf_odometry import TfOdometry
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.node import run
from nodlidar_common.ros.node_parameters import declare
from nodlidar_common.survival import Survival
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState, LaserScan, PointCloud2

# Messages that wait while the node is busy or stopped: for ten seconds.
SCANS_WAITING, STATES_WAITING = 100, 1000


class Assembler(Node):
    """Gives every beam of each scan its own pose and publishes the points."""

    CLOCK_WAS_SET = 'the clock was set'
    UNSETTLED = f'within {SETTLING_NS / NS_PER_S} s after the clock was set'

    def __init__(self) -> None:
        super().__init__('assembler')
        profile = PROFILES[declare(self, ProfileConfig).profile]
        self.config = declare(self, AssemblerConfig, self._reconfigure, profile)
        self.survival = Survival(self.get_logger().error)
        self._clock_watch = HostClock(self, self._clock_was_set)
        self._nod = None
        if self.config.command_nod:
            self._nod = NodCommander(self, self.config, self.survival)
        self._surroundings = Surroundings(self.config)
        self._clouds = self.create_publisher(
            PointCloud2,
            'points',
            QoSProfile(depth=10),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self._make_way()
        if self.config.coverage_window > 0.0:
            CoverageReport(
                self, self.diagnosis.updater, self.config, self._surroundings.covered, self._nod
            )

    def _make_way(self) -> None:
        """Make what makes clouds of messages, with all its inputs."""
        config = self.config
        heard = Input(self, LaserScan, 'scan', SCANS_WAITING, self.survival)
        states = Input(self, JointState, 'joint_states', STATES_WAITING, self.survival)
        settled_scans, settled_states = SimpleFilter(), SimpleFilter()
        heard.registerCallback(self._pass_on_settled, settled_scans)
        states.registerCallback(self._pass_on_settled, settled_states)
        self._scans = ScanFilter(settled_scans, config, lambda reason: self._to_cloud.drop(reason))
        self._scans.registerCallback(self._scan_arrived)
        self.odometry = None
        if config.ego_motion != 'off':
            self.odometry = TfOdometry(
                self,
                config.odom_frame,
                config.frame_id,
                self.survival,
                lambda reason: self._to_cloud.drops.update([reason]),
            )
            self._frames = CloudFrames(self, config.odom_frame)
        self._to_cloud = ScanToCloud(
            config,
            self._scans,
            settled_states,
            self.odometry,
            self._clock_watch.patience_ns,
            self._made,
            lambda text: self.get_logger().warning(text, throttle_duration_sec=5.0),
        )
        states.registerCallback(self._note_publisher, states)
        self.inputs = {'scans': heard, 'joint states': states}
        self.diagnosis = Diagnosis(
            self, config.frame_id, self._to_cloud, self._scans, self.inputs, self.survival
        )

    def _pass_on_settled(self, message: LaserScan | JointState, to: SimpleFilter) -> None:
        """Pass on a message whose stamp is surely by the clock as it is now."""
        if self._clock_watch.look():
            to.signalMessage(message)
        else:
            kind = 'scan' if isinstance(message, LaserScan) else 'joint state'
            self._to_cloud.drops[f'{kind} {self.UNSETTLED}'] += 1

    def _clock_was_set(self, step_ns: int) -> None:
        """Begin anew with all but the nod, which goes on by the new time."""
        self.get_logger().warning(f'the clock was set by {step_ns / NS_PER_S:.3f} s')
        self._scans.watch.shift(step_ns)
        self._to_cloud.restart(self.CLOCK_WAS_SET)
        if self.odometry is not None:
            self.odometry.restart()
        self._surroundings.restart()
        if self._nod is not None:
            self._nod.clock_was_set(step_ns)

    def _note_publisher(self, message: JointState, states: Input) -> None:
        if self._to_cloud.joint.tells_of_joint(message):
            states.publishers.note(states.publisher)

    def _scan_arrived(self, scan: LaserScan) -> None:
        self.diagnosis.scan_arrived(len(scan.ranges))
        if self._nod is not None:
            self._nod.follow_lidar(scan)

    def _made(self, scan: Scan, clouds: list[Points], odometry: Odometry | None) -> None:
        """Publish clouds, then choose the nod by what was covered and what is around."""
        for cloud in clouds:
            frame_id = self.config.frame_id if odometry is None else self._frames.frame(cloud)
            self._clouds.publish(cloud_message(cloud, frame_id))
            self.diagnosis.cloud_published(self._clock_watch.now_ns(), cloud)
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
