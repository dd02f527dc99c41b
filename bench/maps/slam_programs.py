"""SLAM programs from PyPI, fed with our clouds: the pose of each cloud in the frame of the first.

Each is called with a cloud and the pose of its frame by odometry, as a matrix; it returns the pose
that it estimates.
"""

from __future__ import annotations

from typing import Any

from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Array
from nodlidar_mapper.geometry.poses import between, inverse, moved, planar, yaw_of
import numpy as np

KEYFRAME = 0.5  # m or rad
SUBMAP = 8.0  # m
SPACING = 0.1  # m: distance between points
FARTHEST = 0.5  # m: of points that match


class Predicted:
    """Predicts the pose by the odometry since the cloud before."""

    def __init__(self) -> None:
        self.pose = np.eye(4)
        self._odometry: Array | None = None

    def motion(self, odometry: Array) -> Array:
        """Return the motion since the cloud before."""
        before, self._odometry = self._odometry, odometry
        return np.eye(4) if before is None else inverse(before) @ odometry


class OdometryAlone(Predicted):
    """Odometry, as it is."""

    def add(self, cloud: Points, odometry: Array) -> Array:
        """Return the pose of a cloud."""
        self.pose = self.pose @ self.motion(odometry)
        return self.pose


class Kiss:
    """kiss-icp with the parameters of its node, as we ship them.

    Parameters
    ----------
    parameters
        Of the node.
    prior
        Whether odometry is the prediction, which its node has no input for; else the motion
        before.
    """

    def __init__(self, parameters: dict[str, Any], prior: bool) -> None:
        from kiss_icp.config import KISSConfig
        from kiss_icp.kiss_icp import KissICP

        config = KISSConfig(data=parameters['data'], mapping=parameters['mapping'])
        config.registration.max_num_threads = 1
        self._kiss, self._prior, self._predicted = KissICP(config), prior, Predicted()

    def add(self, cloud: Points, odometry: Array) -> Array:
        """Return the pose of a cloud."""
        motion = self._predicted.motion(odometry)
        if self._prior:
            self._kiss.last_delta = motion
        points = cloud.xyz
        self._kiss.register_frame(points, np.zeros(len(points)))
        return np.asarray(self._kiss.last_pose)


class SmallGicp(Predicted):
    """small_gicp, each cloud to a submap of keyframes, in the plane, predicted by odometry."""

    def __init__(self) -> None:
        import small_gicp

        super().__init__()
        self._gicp = small_gicp
        self._keyframes: list[tuple[Array, Array]] = []

    def add(self, cloud: Points, odometry: Array) -> Array:
        """Return the pose of a cloud."""
        self.pose = self.pose @ self.motion(odometry)
        source, _ = self._gicp.preprocess_points(cloud.xyz, SPACING)
        if self._keyframes:
            found = self._gicp.align(
                self._target, source, self._tree, self.pose, max_correspondence_distance=FARTHEST
            ).T_target_source
            self.pose = planar(found[0, 3], found[1, 3], yaw_of(found))
        self._extend(source.points()[:, :3])
        return self.pose

    def _extend(self, points: Array) -> None:
        """Make a keyframe of a cloud that is away from all others, and the submap anew."""
        apart = [between(pose, self.pose) for pose, _ in self._keyframes]
        if any(distance < KEYFRAME and turn < KEYFRAME for distance, turn in apart):
            return
        self._keyframes.append((self.pose, points))
        near = [
            moved(pose, its)
            for pose, its in self._keyframes
            if between(pose, self.pose)[0] < SUBMAP
        ]
        joined = np.concatenate(near)
        self._target, self._tree = self._gicp.preprocess_points(joined, SPACING)
