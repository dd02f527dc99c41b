"""What the page shows while a browser is connected."""

from collections import deque
import math
import time
from typing import Any

from nodlidar_common.arrays import Array
from nodlidar_common.pose import Pose
from nodlidar_common.ros.point_cloud import coordinates
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S, time_ns
from nodlidar_viewer import words
from nodlidar_viewer.config import ViewerConfig
from nodlidar_viewer.directions import Directions
from nodlidar_viewer.fan import fan
from nodlidar_viewer.page import Page
from nodlidar_viewer.recent_points import RecentPoints
from nodlidar_viewer.robot_model import RobotModelError, shapes_of
from nodlidar_viewer.ros import inputs
from nodlidar_viewer.ros.inputs import Inputs
from nodlidar_viewer.ros.transforms import Transforms
from nodlidar_viewer.state_panel import StatePanel
import numpy as np
from rclpy.node import Node

WORDS_PERIOD = 1.0  # s
PATIENCE = 1.0  # s that a cloud waits for its transform
MOST_WAITING = 50  # clouds
FARTHEST = 10_000.0  # m; the page counts in 16 bits


class View:
    """Takes what is new from the topics and draws it.

    Parameters
    ----------
    node
        Subscribes to the topics.
    config, page, panel
        How and where it is drawn.

    Attributes
    ----------
    recent
        The points that are shown.
    """

    def __init__(self, node: Node, config: ViewerConfig, page: Page, panel: StatePanel) -> None:
        self._config, self._page, self._panel = config, page, panel
        self._log = node.get_logger()
        self.recent = RecentPoints(config.most_points)
        self._directions = Directions()
        self._waiting: deque[tuple[Any, int]] = deque()  # clouds, with their arrival [ns]
        self._missing = ''  # what the last cloud lacks
        self._covered = -math.inf  # when coverage was heard [s]
        self._undrawn: dict[str, Any] = {}  # map and path, until their frame is known
        self._statuses: dict[str, words.Status] = {}
        self._texts_ns = self._heard_ns = steady_ns()
        self._inputs, self._transforms = Inputs(node), Transforms(node)

    def step(self) -> None:
        """Draw what is new."""
        self._transforms.take()
        seconds = (steady_ns() - self._texts_ns) / NS_PER_S
        with self._page.at_once():
            self._draw()
            if seconds >= WORDS_PERIOD:
                self._show_texts(seconds)

    def end(self) -> None:
        """End the subscriptions, and clear the page."""
        self._inputs.end()
        self._transforms.end()
        self._page.scene.clear()

    def _pose(self, frame: str, stamp_ns: int = 0) -> Pose | None:
        """Return the pose of a frame in the fixed frame, at an instant [ns] or the latest."""
        return self._transforms.pose(self._config.fixed_frame, frame, stamp_ns)

    # What is drawn.

    def _draw(self) -> None:
        for message in self._inputs.take(inputs.MODEL):
            self._draw_model(message.data)
        for link in self._page.scene.links:
            self._page.scene.place_link(link, self._pose(link))
        self._draw_clouds()
        for scan in self._inputs.take(inputs.SCANS)[-1:]:
            self._draw_scan(scan)
        for topic, draw in ((inputs.MAP, self._draw_map), (inputs.PATH, self._draw_path)):
            for message in self._inputs.take(topic):
                self._undrawn[topic] = message
            frame = self._undrawn[topic].header.frame_id if topic in self._undrawn else ''
            if frame and (pose := self._pose(frame)) is not None:
                draw(self._undrawn.pop(topic), pose)

    def _draw_model(self, urdf: str) -> None:
        try:
            self._page.scene.show_model(shapes_of(urdf))
        except RobotModelError as error:
            self._log.warning(str(error))

    def _draw_clouds(self) -> None:
        now_ns = steady_ns()
        self._waiting.extend((message, now_ns) for message in self._inputs.take(inputs.CLOUDS))
        while len(self._waiting) > MOST_WAITING:
            self._waiting.popleft()
        while self._waiting:
            # Removed first, so that a cloud that raises an error does not block the others.
            message, since_ns = first = self._waiting.popleft()
            is_new = now_ns - since_ns < PATIENCE * NS_PER_S
            if not self._add_cloud(message) and is_new:
                self._waiting.appendleft(first)
                break
        self._page.scene.show_cloud(self.recent.chunks)

    def _add_cloud(self, message: Any) -> bool:
        """Add a cloud; return whether the transforms at its stamp are known."""
        stamp_ns, frame = time_ns(message.header.stamp), message.header.frame_id
        pose = self._pose(frame, stamp_ns)
        self._missing = self._transforms.missing
        if pose is None:
            return False
        points = self._points_of(message)
        self.recent.add(stamp_ns, pose.to_parent(points).astype(np.float32))
        axis = self._transforms.pose(frame, self._config.sensor_frame, stamp_ns)
        if axis is not None:
            self._directions.add(stamp_ns, axis.to_child(points).astype(np.float32))
        self._heard_ns = steady_ns()
        return True

    def _points_of(self, message: Any) -> Array:
        """Return the points of a cloud [m], shape (n, 3), but for NaN, as in organised clouds."""
        try:
            points = coordinates(message)
        except ValueError as error:
            self._log.warning(str(error), throttle_duration_sec=5.0)
            return np.empty((0, 3))
        return np.asarray(points[(np.abs(points) < FARTHEST).all(axis=1)])

    def _draw_scan(self, scan: Any) -> None:
        pose = self._pose(scan.header.frame_id, time_ns(scan.header.stamp))
        if pose is not None:
            ranges = np.array(scan.ranges, dtype=np.float32)
            limits = scan.range_min, scan.range_max
            mesh = fan(ranges, scan.angle_min, scan.angle_increment, *limits)
            self._page.scene.show_fan(*mesh, pose)

    def _draw_map(self, message: Any, pose: Pose) -> None:
        points = self._points_of(message)
        if len(points):
            every = -(-len(points) // self._config.most_map_points)
            self._page.scene.show_map(pose.to_parent(points[::every]).astype(np.float32))

    def _draw_path(self, message: Any, pose: Pose) -> None:
        places = [stamped.pose.position for stamped in message.poses]
        if len(places) > 1:
            points = np.array([[place.x, place.y, place.z] for place in places])
            self._page.scene.show_path(pose.to_parent(points))

    # Texts.

    def _show_texts(self, seconds: float) -> None:
        now = time.monotonic()
        for array in self._inputs.take(inputs.DIAGNOSTICS):
            for each in array.status:
                level = int.from_bytes(each.level, 'little')
                self._statuses[each.name] = words.Status(each.name, level, each.message, now)
        states = words.diagnostics(self._statuses.values(), now)
        rates = words.rates(self._inputs.new_counts(), seconds)
        self._panel.show_texts(self._notice(), states, rates)
        self._texts_ns = steady_ns()
        for message in self._inputs.take(inputs.COVERAGE):
            text = words.coverage(message.seen, message.largest_hole, message.window, message.cell)
            self._panel.show_coverage(text, self._directions.picture())
            self._covered = now
        if now - self._covered > words.SILENT:
            self._panel.forget_coverage()

    def _notice(self) -> str:
        silent = (steady_ns() - self._heard_ns) / NS_PER_S
        if silent < 2.0:
            return f'{self.recent.count} points'
        return f'**No cloud for {silent:.0f} s.** {words.plain(self._missing)}'
