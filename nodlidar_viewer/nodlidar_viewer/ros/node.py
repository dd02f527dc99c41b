"""The viewer node: what the sensor publishes, on a page in a browser."""

from typing import Any

from nodlidar_common.ros.node_parameters import declare
from nodlidar_common.ros.steady import create_steady_timer
from nodlidar_common.survival import Survival
from nodlidar_viewer.config import ViewerConfig
from nodlidar_viewer.controls import ADAPTS, Controls, NOD, PROFILE
from nodlidar_viewer.page import Page
from nodlidar_viewer.point_file import ply_bytes
from nodlidar_viewer.recent_points import RecentPoints
from nodlidar_viewer.ros.commands import RosCommands
from nodlidar_viewer.ros.view import View
from nodlidar_viewer.state_panel import StatePanel
from rclpy.node import Node


class ViewerNode(Node):
    """Shows clouds, scan, robot, map and states; it subscribes and draws only for browsers."""

    def __init__(self) -> None:
        super().__init__('viewer')
        self.config = declare(self, ViewerConfig)
        self.survival = Survival(self.get_logger().error)
        self._view: View | None = None
        self._timer: Any = None
        opened = self.create_guard_condition(self._begin)
        self._commands = RosCommands(self, self.survival)
        self.page = Page(self.config, self._saved, opened.trigger, self._add_controls)
        self._panel = StatePanel(self.page.gui)
        self.get_logger().info(f'open {self.page.address} in a browser')

    def _begin(self) -> None:
        """Subscribe: a browser is connected."""
        if self._view is None:
            self._view = View(self, self.config, self.page, self._panel)
            self._timer = create_steady_timer(self, 1.0 / self.config.frame_rate, self._step)

    def _step(self) -> None:
        """Draw, or end the view if no browser is connected any more."""
        if self._view is None:
            return
        if self.page.is_watched:
            with self.survival.surviving():
                self._view.step()
        else:
            self.destroy_timer(self._timer)
            self._view.end()
            self._view = None

    def _add_controls(self, client: Any) -> None:
        """Let a browser control the sensor, as soon as the parameters are known."""
        self._commands.read(
            [*NOD, ADAPTS, PROFILE],
            lambda values: Controls(client, values, self._commands),
            lambda text: client.gui.add_markdown(f'No controls: {text}.'),
        )

    def _saved(self) -> tuple[str, bytes]:
        """Return the points that are shown, in the thread of the page."""
        view = self._view  # None if the browser has just gone
        recent = RecentPoints(0) if view is None else view.recent
        return 'points.ply', ply_bytes(recent.points, self.config.fixed_frame)

    def destroy_node(self) -> None:
        """Close the page, then destroy the node."""
        self.page.stop()
        super().destroy_node()
