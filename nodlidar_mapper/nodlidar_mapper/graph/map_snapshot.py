"""The map and the path of the robot, as they are after a cloud."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_mapper.graph.keyframe import Estimate, Keyframe
from nodlidar_mapper.graph.pose_graph import Edge


@dataclass(frozen=True, slots=True, eq=False)
class MapSnapshot:
    """What is known after a cloud: the map, and the path of the robot.

    Attributes
    ----------
    estimate
        Where the cloud was taken.
    keyframes, edges
        Of the map, as they are now.
    loops
        Number of loops closed.
    stamps_ns, path
        Where the robot was [ns], as poses in the map, shape (n, 4, 4).
    """

    estimate: Estimate
    keyframes: list[Keyframe]
    edges: list[Edge]
    loops: int
    stamps_ns: list[int]
    path: Array
