"""The ROS node of a launch, which talks to the nodes launched."""

from __future__ import annotations

import os
import threading

from launch import LaunchContext
from launch.event_handlers import OnShutdown
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


class RosAdapter:
    """A ROS node that spins in a thread of its own."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(args=[], context=self._context)
        self.node = Node(f'launch_ros_{os.getpid()}', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            return

    def shutdown(self) -> None:
        """Stop spinning, and take the node out of the graph."""
        self._executor.shutdown()
        rclpy.shutdown(context=self._context)
        self._thread.join()
        self.node.destroy_node()


def get_ros_node(context: LaunchContext) -> Node:
    """Return the launch's node, made the first time and gone at shutdown."""
    adapter = context.get_locals_as_dict().get('ros_adapter')
    if adapter is None:
        adapter = RosAdapter()
        context.extend_globals({'ros_adapter': adapter})
        context.register_event_handler(
            OnShutdown(on_shutdown=lambda *_: adapter.shutdown(), handle_once=True)
        )
    return adapter.node
