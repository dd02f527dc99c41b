"""Maps while the robot drives: one call per cloud, with all that is to be published."""

from __future__ import annotations

from nodlidar_common.arrays import Array
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.graph.keyframe import Estimate
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.mapper import Mapper
import numpy as np

LEAST_COVARIANCE = np.diag([0.01**2] * 6)  # of a pose that a person set [m^2], [rad^2]
MOST_PLACES = 1000  # of a path; beyond it, every second one is forgotten


class LiveMapper:
    """A Mapper that remembers the path.

    Parameters
    ----------
    mapper
        An empty map, or one to be continued.
    """

    def __init__(self, mapper: Mapper) -> None:
        self.mapper = mapper
        self._path: list[Estimate] = []

    def place(self, pose: Array, stamp_ns: int, odometry: Array, covariance: Array) -> None:
        """Continue at a given pose, see Mapper.place."""
        self.mapper.place(pose, stamp_ns, odometry, covariance + LEAST_COVARIANCE)

    def add(self, cloud: Cloud) -> MapSnapshot:
        """Match a cloud, see Mapper.add; return what is known then."""
        self._path.append(self.mapper.add(cloud))
        if len(self._path) > MOST_PLACES:
            del self._path[1:-1:2]
        return self.mapper.snapshot(self._path)


def continued(snapshot: MapSnapshot, config: MapConfig) -> LiveMapper:
    """Return the mapper of the map as it was after a cloud; the robot may be anywhere in it."""
    return LiveMapper(Mapper(config, snapshot.keyframes, snapshot.edges))
