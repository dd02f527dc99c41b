"""The mapper node: deskewed clouds and odometry in, where the robot is and the map out."""

from pathlib import Path
import sys

from geometry_msgs.msg import PoseWithCovarianceStamped
from nodlidar_common.arrays import Array
from nodlidar_common.command_line import in_words
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.pose import Pose
from nodlidar_common.ros.messages import transform_message
from nodlidar_common.ros.node import run
from nodlidar_common.ros.node_parameters import declare
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.survival import Survival
from nodlidar_mapper.background import Background
from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.geometry.poses import inverse, placed
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.live import continued, LiveMapper
from nodlidar_mapper.mapper import Mapper, NO_MAP
from nodlidar_mapper.output.map_folder import load
from nodlidar_mapper.ros import messages
from nodlidar_mapper.ros.cloud_input import CloudInput
from nodlidar_mapper.ros.diagnosis import Diagnosis, doubt_of
from nodlidar_mapper.ros.map_output import MapOutput
import numpy as np
from rclpy.node import Node
from tf2_ros import TransformBroadcaster

STEP_PERIOD = 0.05  # s: odometry, map -> odom, and the results of the threads


class MapperNode(Node):
    """Matches each cloud to the map, publishes where the robot is, and the map.

    Matching and drawing have a thread each; all else happens in that of the executor.
    """

    def __init__(self) -> None:
        super().__init__('mapper')
        self.config = declare(self, MapperConfig)
        self.survival = Survival(self.get_logger().error)
        self._mapper = self._first_mapper()
        self._map_from_odometry: Array | None = None  # the last good one
        self._given: tuple[Array, Array] | None = None  # map -> odom that a person set, covariance
        self._matching = Background()
        self._broadcaster = TransformBroadcaster(self)
        self._pose = self.create_publisher(
            PoseWithCovarianceStamped, 'pose', 10, qos_overriding_options=OVERRIDABLE
        )
        self.output = MapOutput(self, self.config, self._continue_with)
        self.clouds = CloudInput(
            self, self.config, self.survival, self._match_next, self._time_went_back
        )
        self.create_subscription(
            PoseWithCovarianceStamped,
            'initialpose',
            self._pose_was_set,
            1,
            qos_overriding_options=OVERRIDABLE,
        )
        self.diagnosis = Diagnosis(self)
        topics = ', '.join(self.config.cloud_topics)
        self.get_logger().info(f'waiting for clouds on {topics}')
        create_steady_timer(self, STEP_PERIOD, self._step)

    def _first_mapper(self) -> LiveMapper:
        """Return the mapper of a new map, or of a saved one."""
        folder = self.config.map_folder
        if not folder:
            return LiveMapper(Mapper(self.config))
        try:
            return LiveMapper(Mapper(self.config, *load(Path(folder))))
        except (NodlidarError, OSError) as error:
            limit = f'a saved map ({in_words(error)})'
            raise ParameterError('map_folder', limit, folder) from error

    def _continue_with(self, mapper: LiveMapper) -> None:
        """Continue with another map; where the robot is in it, is not known yet."""
        self._mapper, self._map_from_odometry, self._given = mapper, None, None
        self.output.begin()

    # Clouds.

    def _match_next(self) -> None:
        """Start to match a cloud, if one is ready."""
        cloud = None if self._matching.busy else self.clouds.next()
        if cloud is None:
            return
        begin_ns, mapper = steady_ns(), self._mapper
        given, self._given = self._given, None

        def work() -> MapSnapshot:
            if given is not None:
                map_from_odometry, covariance = given
                stamp_ns, robot = cloud.robot
                mapper.place(map_from_odometry @ robot, stamp_ns, robot, covariance)
            return mapper.add(cloud)

        self._matching.start(work, lambda found: self._matched(mapper, found, begin_ns))

    def _matched(self, mapper: LiveMapper, snapshot: MapSnapshot, begin_ns: int) -> None:
        """Publish where the robot is, unless it is lost or another map was begun meanwhile."""
        if mapper is not self._mapper:
            return
        self._log_change(self.output.snapshot, snapshot)
        self.output.snapshot = snapshot
        self.diagnosis.matched((steady_ns() - begin_ns) / NS_PER_S)
        estimate, config = snapshot.estimate, self.config
        if estimate.map_from_odometry is not None and self._given is None:
            self._map_from_odometry = estimate.map_from_odometry
        if not estimate.matched:
            return  # the pose is that of odometry alone, which a filter would count twice
        base = self.clouds.odometry_of(config.base_frame, estimate.stamp_ns)
        if base is not None and self._map_from_odometry is not None:
            pose, covariance = self._map_from_odometry @ base, estimate.covariance
            at = estimate.stamp_ns, config.map_frame
            self._pose.publish(messages.estimate_message(pose, covariance, *at))

    def _log_change(self, before: MapSnapshot | None, now: MapSnapshot) -> None:
        """Log when the robot is found in the map, lost or uncertain, and closed loops."""
        log, lost = self.get_logger(), now.estimate.lost
        lost_before = before.estimate.lost if before else NO_MAP
        if lost not in ('', NO_MAP) and not lost_before:
            log.warning(f'the robot is lost: {lost}')
        elif lost_before and not lost:
            log.info('the robot is found in the map')
        if (doubt := doubt_of(now)) and not doubt_of(before):
            log.warning(doubt)
        if now.loops > (before.loops if before else 0):
            log.info(f'loops closed: {now.loops}')

    # All the time.

    def _step(self) -> None:
        """Take odometry and the results of the threads, and keep map -> odom fresh."""
        self.clouds.odometry.take()
        for take in (self._matching.deliver, self.output.step):
            with self.survival.surviving():
                take()
        self._match_next()
        if self._map_from_odometry is None:
            return
        ahead_ns = round(self.config.transform_tolerance * NS_PER_S)
        stamp_ns = self.get_clock().now().nanoseconds + ahead_ns
        frames = self.config.map_frame, self.config.odom_frame
        pose = Pose(self._map_from_odometry[:3, 3], self._map_from_odometry[:3, :3])
        self._broadcaster.sendTransform(transform_message(stamp_ns, *frames, pose))

    def _time_went_back(self) -> None:
        """Keep the map, unless a bag begins again; where the robot is in it, nobody knows."""
        if self.get_parameter('use_sim_time').value:
            try:
                first = self._first_mapper()
            except ParameterError as error:  # it was moved meanwhile
                self.get_logger().error(f'the map does not begin anew: {error}')
            else:
                self.get_logger().warning('time went back: the map begins anew')
                self._continue_with(first)
                return
        self.get_logger().warning('time went back: the robot is searched in the whole map')
        self._map_from_odometry = self._given = None
        if self.output.snapshot is not None:  # it stays, to be drawn and saved
            self._mapper = continued(self.output.snapshot, self.config)

    def _pose_was_set(self, message: PoseWithCovarianceStamped) -> None:
        """Continue at a pose that a person set, with the newest odometry."""
        if refused := self._place(message):
            self.get_logger().warning(f'initialpose ignored: {refused}')

    def _place(self, message: PoseWithCovarianceStamped) -> str:
        """Let the map continue at a pose; return why not."""
        config, clouds = self.config, self.clouds
        if message.header.frame_id != config.map_frame:
            return f"its frame is '{message.header.frame_id}', not '{config.map_frame}'"
        if clouds.newest_ns is None:
            return f'there is no odometry: {clouds.odometry.missing_input}'
        covariance = np.reshape(message.pose.covariance, (6, 6))
        base = clouds.odometry_of(config.base_frame, clouds.newest_ns)
        try:
            pose = messages.matrix_of_pose(message.pose.pose)
        except ValueError as error:
            return str(error)
        if base is None or not messages.is_covariance(covariance):
            return 'its covariance is not one, or odometry went'
        if config.freedom == 'planar':  # a pose drawn in RViz has neither height nor tilt
            before = self._map_from_odometry
            pose = placed(base if before is None else before @ base, pose)
        self._map_from_odometry = pose @ inverse(base)
        self._given = self._map_from_odometry, covariance
        return ''

    @property
    def answering(self) -> bool:
        """Whether a request for the map was not answered yet."""
        return self.output.unanswered > 0

    def destroy_node(self) -> None:
        """Save the map, wait for the threads, then destroy the node; note if it was not saved."""
        self.output.end()
        self._matching.end()
        self.failed = bool(self.output.kept.unsaved)
        super().destroy_node()


def main() -> None:
    """Run the mapper node."""
    sys.exit(run(MapperNode))
