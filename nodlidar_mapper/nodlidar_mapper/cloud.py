"""A cloud as the mapper takes it."""

from dataclasses import dataclass, field

from nodlidar_common.arrays import Array
from nodlidar_mapper.geometry.poses import inverse
import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """A deskewed cloud, and odometry at its instant.

    Attributes
    ----------
    stamp_ns
        Its instant [ns].
    points
        In the cloud's frame [m], shape (n, 3).
    odometry
        Pose of the cloud's frame in the frame of odometry at that instant, as a matrix.
    mount
        Pose of the cloud's frame in that of the robot, where several sensors have their own; by
        default it is the same.
    age
        Time from each point's measurement to the instant of the cloud [s], shape (n,), by which
        errors of odometry are taken out of the deskewing; None if unknown.
    silence
        Time without odometry since the cloud before [s]: what odometry says after it may count
        from elsewhere.
    """

    stamp_ns: int
    points: Array
    odometry: Array
    mount: Array = field(default_factory=lambda: np.eye(4))
    age: Array | None = None
    silence: float = 0.0

    @property
    def robot(self) -> tuple[int, Array]:
        """Its stamp [ns], and the pose of the robot in the frame of odometry."""
        return self.stamp_ns, self.odometry @ inverse(self.mount)
