"""The assembler node: scans and joint states in, point clouds and the nod command out."""

from collections.abc import Callable, Sequence
from dataclasses import replace
import sys

from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ros.assembly_filter import AssemblyFilter
from nodlidar_assembler.ros.clock_watch import ClockWatch
from nodlidar_assembler.ros.cloud_frames import CloudFrames
from nodlidar_assembler.ros.cloud_message import cloud_message
from nodlidar_assembler.ros.coverage_report import CoverageReport
from nodlidar_assembler.ros.diagnosis import Diagnosis
from nodlidar_assembler.ros.input import PolledInput, SingleInput
from nodlidar_assembler.ros.level_scan_publisher import LevelScanPublisher
from nodlidar_assembler.ros.nod_publisher import NodPublisher
from nodlidar_assembler.ros.profile_change import ProfileChange
from nodlidar_assembler.ros.region_action import RegionAction
from nodlidar_assembler.ros.scan_service import ScanService
from nodlidar_assembler.scan_assembler import Outcome
from nodlidar_common.dynamics import check_pitch
from nodlidar_common.ros.node import run
from nodlidar_common.ros.node_parameters import declare
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.tf_odometry import TfOdometry
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.survival import Survival
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState, LaserScan, PointCloud2

# Messages that wait while the node is busy or stopped: for ten seconds.
SCANS_WAITING, STATES_WAITING = 100, 1000


class AssemblerNode(Node):
    """Places every beam of each scan by its own pose and publishes the points."""

    def __init__(
        self, parameters: Sequence[Parameter] = (), before: NodPublisher | None = None
    ) -> None:
        super().__init__('assembler', parameter_overrides=list(parameters))
        self._profile = ProfileChange(self, lambda chosen: AssemblerNode(chosen, self._nod))
        self.config = declare(
            self,
            AssemblerConfig,
            self._reconfigure,
            self._profile.defaults,
            check_change=self._check_change,
        )
        self.survival = Survival(self.get_logger().error)
        self._clock_watch = ClockWatch(self, self._clock_was_set)
        self._nod = None
        if self.config.command_nod:
            own = self, self.config, self._clock_watch, self.survival
            self._nod = NodPublisher(*own, before)
        self._clouds = self.create_publisher(
            PointCloud2, 'points', 10, qos_overriding_options=OVERRIDABLE
        )
        self._level_scan: LevelScanPublisher | None = None
        if self.config.level_scan != 'off':
            self._level_scan = LevelScanPublisher(self, self.config)
        self._subscribe()
        self._scan_service: ScanService | None = None
        if self.config.scan_memory > 0.0:
            self._scan_service = ScanService(self, self.config, self._frame_id)
        self._region = RegionAction(self, self.config, self._nod, self._frame_id, self.survival)
        self._coverage: CoverageReport | None = None
        if self.config.coverage_window > 0.0:
            self._coverage = CoverageReport(self, self.diagnosis.updater, self.config, self._nod)

    def _subscribe(self) -> None:
        """Subscribe to scans and joint states, and to TF where the robot moves."""
        self.scans = SingleInput(self, LaserScan, 'scan', SCANS_WAITING, self.survival)
        self.states = PolledInput(
            self,
            JointState,
            'joint_states',
            STATES_WAITING,
            self.survival,
            lambda: self.assembly.assembler.is_waiting,
            self._take_odometry,
        )
        self.scans.registerCallback(lambda scan: self._take_odometry())  # before it, as it came
        self.assembly = AssemblyFilter(
            self.scans,
            self.states,
            self.config,
            self._clock_watch,
            self._warn,
            self._missing_odometry,
        )
        self.odometry: TfOdometry | None = None
        self._compensates = self.config.ego_motion != 'off'
        if self._compensates:
            self._frames = CloudFrames(self, self.config.odom_frame)
        self._hear_odometry()
        self.assembly.scans.registerCallback(self._scan_arrived)
        self.assembly.registerCallback(self._publish)
        needed = self.odometry if self._compensates else None
        self.diagnosis = Diagnosis(
            self,
            self.config,
            self.assembly,
            needed,
            self.scans,
            self.states,
            self.survival,
            lambda: None if self._nod is None else self._nod.commanded,
        )
        self.scans.registerCallback(lambda scan: self.diagnosis.updater.check())

    def _hear_odometry(self) -> None:
        """Listen to TF as long as clouds or limits depend on the motion of the robot."""
        needed = self._compensates or self.config.adapt_limits
        if needed and self.odometry is None:
            self.odometry = self._tf_odometry()
        elif not needed and self.odometry is not None:
            self.odometry.unregister()
            self.odometry = None

    def _tf_odometry(self) -> TfOdometry:
        return TfOdometry(
            self,
            self.config.odom_frame,
            self.config.frame_id,
            self.assembly.add_odometry,
            self.assembly.odometry_went_back,
            self.survival,
            lambda reason: self.assembly.assembler.drops.update([reason]),
            self.config.odometry_period,
        )

    def _take_odometry(self) -> None:
        if self.odometry is not None:
            self.odometry.take()

    def _missing_odometry(self) -> str:
        if not self._compensates or self.odometry is None:
            return ''
        return self.odometry.missing_input

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=5.0)

    def _clock_was_set(self, step_ns: int) -> None:
        """Restart all but the nod, which continues in the new time."""
        self.get_logger().warning(f'the clock was set by {step_ns / NS_PER_S:.3f} s')
        self.assembly.clock_was_set(step_ns)
        self.diagnosis.clock_was_set()
        if self.odometry is not None:
            self.odometry.restart()
        if self._coverage is not None:
            self._coverage.monitor.restart()
        if self._level_scan is not None:
            self._level_scan.scanner.restart()
        if self._scan_service is not None:
            self._scan_service.memory.restart()
        if self._nod is not None:
            self._nod.clock_was_set(step_ns)
        self._region.clock_was_set()  # gives the nod back in the new time

    def _scan_arrived(self, scan: Scan) -> None:
        """Keep the nod phase-locked to the lidar, before the scan waits for its bracket."""
        self.diagnosis.scan_arrived(scan)
        if self._nod is not None:
            with self.survival.surviving():  # the scan counts, whatever becomes of the nod
                self._nod.follow_lidar(scan)
            if (nod := self._nod.commanded) is not None:
                self.assembly.assembler.command_sweeps(nod.sweep_duration)
                if self._level_scan is not None:
                    self._level_scan.scanner.commanded_ns = round(nod.sweep_duration * NS_PER_S)

    def _publish(self, outcome: Outcome) -> None:
        """Publish a scan's clouds, then choose the nod by what it shows."""
        assembled = outcome.assembled
        if assembled is None:
            return
        for cloud in assembled.clouds:
            frame_id = self._frame_id(cloud, assembled.in_odometry)
            self._clouds.publish(cloud_message(cloud, frame_id))
            self.diagnosis.cloud_published(self._clock_watch.now_ns(), cloud)
        # A region has the rows of a part of the nod: all above and below would seem to be free.
        if self._level_scan is not None and not self._region.is_busy:
            self._level_scan.add(assembled)
        if self._scan_service is not None:
            self._scan_service.add(assembled)
        self._region.add(assembled)
        self.diagnosis.agreement.add(assembled)
        if self._coverage is not None:
            self._coverage.monitor.add(assembled)
        if self._nod is not None:
            self._nod.adapt(assembled, outcome.odometry)

    def _frame_id(self, cloud: Points, in_odometry: bool) -> str:
        return self._frames.frame(cloud) if in_odometry else self.config.frame_id

    def _check_change(self, config: AssemblerConfig) -> None:
        """Raise ParameterError for new limits beyond the mount's: the servo would let go."""
        for key in ('pitch_min', 'pitch_max'):
            pitch = getattr(config, key)
            is_new = pitch != getattr(self.config, key) and self._nod is not None
            if is_new and (limits := self._region.stated_limits) is not None:
                check_pitch(key, pitch, limits)

    def _reconfigure(self, config: AssemblerConfig) -> None:
        before, self.config = self.config, config
        if self._nod is not None and config.adapt_limits != before.adapt_limits:
            self._nod.controller.configure_limits(config)
        if config != replace(before, adapt_limits=config.adapt_limits):
            for part in (self._nod, self._coverage, self._region):
                if part is not None:
                    part.reconfigure(config)
        self._hear_odometry()

    @property
    def scans_region(self) -> bool:
        """Whether a goal of scan_region runs."""
        return self._region.is_busy

    @property
    def successor(self) -> Callable[[], Node] | None:
        """What makes the node that takes over, with another profile."""
        return self._profile.successor

    def destroy_node(self) -> None:
        """Destroy the action, which rclpy leaves, and the node."""
        self._region.destroy()
        super().destroy_node()


def main() -> None:
    """Run the assembler node."""
    sys.exit(run(AssemblerNode))
