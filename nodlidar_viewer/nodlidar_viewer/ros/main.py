"""The program of the viewer."""

import sys

from nodlidar_common.command_line import in_words
from nodlidar_common.errors import NodlidarError
from nodlidar_common.ros.node import run
from rclpy.node import Node


def viewer() -> Node:
    """Return the node; raises NodlidarError if a package is missing."""
    try:
        from nodlidar_viewer.ros.node import ViewerNode
    except ModuleNotFoundError as error:
        raise NodlidarError(in_words(error)) from error
    return ViewerNode()


def main() -> None:
    """Run the viewer node."""
    sys.exit(run(viewer))
