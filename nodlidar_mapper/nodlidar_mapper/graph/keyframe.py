"""What a map consists of, and where clouds were taken."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from nodlidar_common.arrays import Array
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
import numpy as np


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A place of the map, with the surfaces first seen from there. What changes is replaced.

    Attributes
    ----------
    stamp_ns
        Of its cloud [ns].
    pose
        Of the cloud's frame in the map, as a matrix.
    surface
        In the cloud's frame.
    cloud
        Its points, in its frame.
    robot
        Pose of the robot in the cloud's frame.
    """

    stamp_ns: int
    pose: Array
    surface: Surface
    cloud: Seen
    robot: Array = field(default_factory=lambda: np.eye(4))

    @cached_property
    def placed_surface(self) -> Surface:
        """The surface in the frame of the map."""
        return self.surface.moved(self.pose)

    @property
    def placed_cloud(self) -> Seen:
        """The cloud in the frame of the map."""
        return self.cloud.moved(self.pose)


def surface_of_map(keyframes: Sequence[Keyframe]) -> Surface:
    """Return the surfaces of keyframes in the frame of the map."""
    return Surface.joined([each.placed_surface for each in keyframes])


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Where a cloud was taken.

    Attributes
    ----------
    stamp_ns
        Of the cloud [ns].
    pose
        Of its frame in the map, as a matrix.
    map_from_odometry
        Pose of the frame of odometry in the map, the last good one while the robot is lost; None
        until it was found.
    covariance
        Of the change of the robot's pose from where the map began, shape (6, 6): its error in the
        map around, and that of this map. 0 where the pose is that of odometry, as 2D localisers
        state it.
    share, residual
        Share of the points near the map that lie on it, and their RMS distance from it [m]; 0 and
        inf where the map does not reach yet.
    lost
        Why it is not known where the robot is; empty if it is.
    keyframe, from_keyframe
        Index of a keyframe nearby, and the pose in its frame: it moves with the keyframe when a
        loop is closed.
    robot
        Pose of the robot in the cloud's frame.
    """

    stamp_ns: int
    pose: Array
    map_from_odometry: Array | None
    covariance: Array
    share: float
    residual: float
    lost: str
    keyframe: int
    from_keyframe: Array
    robot: Array

    @property
    def uncertainty(self) -> float:
        """The larger standard deviation of x and y [m]."""
        return float(self.covariance.diagonal()[:2].max() ** 0.5)

    @property
    def matched(self) -> bool:
        """Whether the cloud was matched; else the pose is that of odometry alone."""
        return not self.lost and self.share > 0.0
