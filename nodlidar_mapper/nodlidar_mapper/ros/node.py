"""The mapper node: deskewed clouds and odometry in, where the robot is and the map out."""

from collections import Counter
from dataclasses import dataclass
from functools import partial
import sys
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Path
from nodlidar_assembler.ros.tf_odometry import TfOdometry
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.node import run
from nodlidar_common.ros.node_parameters import declare
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from nodlidar_common.stamps import time_ns
from nodlidar_common.survival import Survival
from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.grid import GridConfig
from nodlidar_mapper.live import drawn, LiveMapper, NodeConfig, Progress
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.poses import Array, inverse
from nodlidar_mapper.ros import messages
from nodlidar_mapper.ros.background import Background
from nodlidar_mapper.ros.diagnosis import Diagnosis
import numpy as np
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2
from tf2_ros import TransformBroadcaster, TransformException

STEP_PERIOD = 0.05  # s: map -> odom, and the results of the threads
DRAWING_SHARE = 0.2  # of the time, at most
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

BUSY = 'cloud that came while others were matched'
MALFORMED = 'malformed cloud'
NO_ODOMETRY = 'cloud without odometry at its stamp'


@dataclass(frozen=True)
class Config(GridConfig, MapperConfig, NodeConfig):
    """All parameters of the node."""


class MapperNode(Node):
    """Matches each cloud to the map, publishes where the robot is, and draws the map.

    Matching and drawing have a thread each; all else happens in that of the executor.
    """

    def __init__(self) -> None:
        super().__init__('mapper')
        self.config = declare(self, Config)
        self.survival = Survival(self.get_logger().error)
        self.counts: Counter[str] = Counter(clouds=0)
        self.drops: Counter[str] = Counter()
        self.progress: Progress | None = None
        self._map_from_odometry = np.eye(4)
        self._waiting: dict[str, tuple[PointCloud2, int]] = {}  # by topic; with the arrival [ns]
        self._matching, self._drawing = Background(), Background()
        self._draw_after_ns = 0
        self._given: tuple[Array, Array] | None = None  # map -> odom that a person set, covariance
        self._begin()
        self._broadcaster = TransformBroadcaster(self)
        self._pose = self.create_publisher(PoseWithCovarianceStamped, 'pose', 10)
        self._path = self.create_publisher(Path, 'path', LATCHED)
        self._grid = self.create_publisher(OccupancyGrid, 'map', LATCHED)
        self._surface = self.create_publisher(PointCloud2, 'map_cloud', LATCHED)
        self._subscribe()
        self.diagnosis = Diagnosis(self)
        topics = ', '.join(self.config.cloud_topics)
        self.get_logger().info(f'waiting for clouds on {topics}')
        create_steady_timer(self, STEP_PERIOD, self._step)

    def _subscribe(self) -> None:
        config = self.config
        self.odometry = TfOdometry(
            self,
            config.odom_frame,
            config.base_frame,
            lambda *_: self._match_next(),
            self._time_went_back,
            self.survival,
            lambda reason: self.drops.update([reason]),
        )
        for topic in config.cloud_topics:
            self.create_subscription(
                PointCloud2,
                topic,
                partial(self._cloud_arrived, topic),
                QoSProfile(depth=5),
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )
        self.create_subscription(PoseWithCovarianceStamped, 'initialpose', self._pose_was_set, 1)

    def _begin(self) -> None:
        """Begin a new map."""
        self._mapper = LiveMapper(Mapper(self.config))
        self.progress = None

    # Clouds.

    def _cloud_arrived(self, topic: str, message: PointCloud2) -> None:
        """Keep the newest cloud of a topic until it can be matched."""
        self.counts['clouds'] += 1
        self.diagnosis.cloud_arrived()
        if topic in self._waiting:
            self.drops[BUSY] += 1
        self._waiting[topic] = message, steady_ns()
        self._match_next()

    def _match_next(self) -> None:
        """Start to match the oldest cloud that has odometry; drop those that waited too long."""
        if self._matching.busy:
            return
        for topic, (message, since_ns) in sorted(
            self._waiting.items(), key=lambda item: time_ns(item[1][0].header.stamp)
        ):
            odometry = self._odometry_at(message)
            if odometry is not None:
                del self._waiting[topic]
                if self._match(message, odometry):
                    return
            elif steady_ns() - since_ns > self.config.odometry_deadline * NS_PER_S:
                del self._waiting[topic]
                self.drops[NO_ODOMETRY] += 1

    def _odometry_at(self, message: PointCloud2) -> Array | None:
        """Return the pose of a cloud's frame in the frame of odometry, at its stamp."""
        return self._lookup(
            self.config.odom_frame, message.header.frame_id, time_ns(message.header.stamp)
        )

    def _lookup(self, target: str, source: str, stamp_ns: int) -> Array | None:
        at = Time(nanoseconds=stamp_ns, clock_type=ClockType.ROS_TIME)
        try:
            found = self.odometry.buffer.lookup_transform(target, source, at)
        except TransformException:
            return None
        return messages.matrix_of(found)

    def _match(self, message: PointCloud2, odometry: Array) -> bool:
        """Start to match a cloud; return whether it is well-formed."""
        try:
            points = messages.coordinates(message)
        except ValueError as error:
            self.drops[MALFORMED] += 1
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return False
        stamp_ns, begin_ns = time_ns(message.header.stamp), steady_ns()
        mapper, given, self._given = self._mapper, self._given, None

        def work() -> Progress:
            if given is not None:
                map_from_odometry, covariance = given
                mapper.place(map_from_odometry @ odometry, stamp_ns, odometry, covariance)
            return mapper.add(stamp_ns, points, odometry)

        self._matching.start(
            work,
            lambda progress: self._matched(mapper, progress, begin_ns),
        )
        return True

    def _matched(self, mapper: LiveMapper, progress: Progress, begin_ns: int) -> None:
        """Publish where the robot is, unless a new map was begun meanwhile."""
        if mapper is not self._mapper:
            return
        self.progress = progress
        estimate = progress.estimate
        self.diagnosis.matched(progress, (steady_ns() - begin_ns) / NS_PER_S)
        self._map_from_odometry = estimate.map_from_odometry
        base = self._lookup(self.config.odom_frame, self.config.base_frame, estimate.stamp_ns)
        if base is not None:
            self._pose.publish(
                messages.estimate_message(
                    self._map_from_odometry @ base,
                    estimate.covariance,
                    estimate.stamp_ns,
                    self.config.map_frame,
                )
            )
        self._draw()

    # The map.

    def _draw(self) -> None:
        """Start to draw the map, from time to time."""
        progress = self.progress
        if self._drawing.busy or steady_ns() < self._draw_after_ns or progress is None:
            return
        begin_ns, frame = steady_ns(), self.config.map_frame

        def draw() -> tuple[Any, ...] | None:
            found = drawn(progress.keyframes, self.config)
            if found is None:
                return None
            stamp_ns = progress.estimate.stamp_ns
            surface, grid = found
            return (
                messages.surface_message(surface, stamp_ns, frame),
                messages.grid_message(grid, stamp_ns, frame),
                messages.path_message(progress.stamps_ns, progress.path, stamp_ns, frame),
            )

        def publish(found: tuple[Any, ...] | None) -> None:
            now_ns = steady_ns()
            pause_ns = (now_ns - begin_ns) * (1.0 / DRAWING_SHARE - 1.0)
            self._draw_after_ns = now_ns + round(max(self.config.map_period * NS_PER_S, pause_ns))
            if found is not None and self.progress is not None:
                for publisher, message in zip(
                    (self._surface, self._grid, self._path), found, strict=True
                ):
                    publisher.publish(message)

        self._drawing.start(draw, publish)

    # All the time.

    def _step(self) -> None:
        """Take the results of the threads, and keep map -> odom fresh."""
        for thread in (self._matching, self._drawing):
            with self.survival.surviving():
                thread.deliver()
        self._match_next()
        if self.progress is not None:
            now_ns = self.get_clock().now().nanoseconds
            self._broadcaster.sendTransform(
                messages.transform_message(
                    self._map_from_odometry,
                    now_ns + round(self.config.transform_tolerance * NS_PER_S),
                    self.config.map_frame,
                    self.config.odom_frame,
                )
            )

    def _time_went_back(self) -> None:
        """Begin a new map: where the robot was moved to meanwhile, nobody knows."""
        self.get_logger().warning('time went back: a new map begins')
        self._waiting.clear()
        self.counts['new maps, as time went back'] += 1
        self._begin()

    def _pose_was_set(self, message: PoseWithCovarianceStamped) -> None:
        """Continue at a pose that a person set, with the newest odometry."""
        refused = self._place(message)
        if refused:
            self.get_logger().warning(f'initialpose ignored: {refused}')

    def _place(self, message: PoseWithCovarianceStamped) -> str:
        """Let the map continue at a pose; return why not."""
        config, newest_ns = self.config, self.odometry.newest_ns
        if message.header.frame_id != config.map_frame:
            return f"its frame is '{message.header.frame_id}', not '{config.map_frame}'"
        if newest_ns is None:
            return f'there is no odometry: {self.odometry.missing_input}'
        try:
            pose = messages.matrix_of_pose(message.pose.pose)
        except ValueError as error:
            return str(error)
        base = self._lookup(config.odom_frame, config.base_frame, newest_ns)
        if base is None:
            return f"'{config.base_frame}' is not in '{config.odom_frame}'"
        self._map_from_odometry = pose @ inverse(base)
        covariance = np.reshape(message.pose.covariance, (6, 6))
        self._given = self._map_from_odometry, covariance
        return ''


def main() -> None:
    """Run the mapper node."""
    sys.exit(run(MapperNode))
