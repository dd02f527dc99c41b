"""The pose of the robot: predicted by odometry, corrected by matches."""

from nodlidar_common.nod import NS_PER_S
from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.matching import Match
from nodlidar_mapper.odometer_scale import OdometerScale
from nodlidar_mapper.poses import Array, between, inverse
import numpy as np

FLOOR = 0.002, 0.001  # error of odometry that does not grow with the motion [m], [rad]
JUMP = np.diag([0.2**2] * 3 + [0.1**2] * 3)  # covariance after a jump of odometry [m2], [rad2]


class Track:
    """Follows the pose of the robot in the map.

    Attributes
    ----------
    pose
        Of the last cloud; None before the first one.
    covariance
        Of its change, shape (6, 6).
    jump
        Why odometry since the cloud before is not believed; empty if it is.
    """

    def __init__(self, config: MapperConfig) -> None:
        self._config = config
        self._scale = OdometerScale()
        self._stamp_ns = 0
        self._odometry = np.eye(4)
        self._last_motion = np.eye(4)
        self.pose: Array | None = None
        self.covariance: Array = np.diag([1e-6] * 6)
        self.jump = ''

    def predicted(self, stamp_ns: int, odometry: Array) -> Array:
        """Return the pose by odometry since the last cloud; the covariance grows.

        If odometry jumped, the robot is expected to have moved as before.
        """
        self.jump = ''
        if self.pose is None:
            return odometry
        motion = inverse(self._odometry) @ odometry
        distance, turn = between(np.eye(4), motion)
        seconds = max(abs(stamp_ns - self._stamp_ns) / NS_PER_S, 0.1)
        config = self._config
        if distance > config.max_speed * seconds or turn > config.max_turn_rate * seconds:
            self.jump = f'odometry jumped by {distance:.1f} m and {turn:.1f} rad'
            self.covariance = self.covariance + JUMP
            return np.asarray(self.pose @ self._last_motion)
        shift, rotation = FLOOR
        slip = config.odometry_slip
        self.covariance = self.covariance + np.diag(
            [(shift + slip * distance) ** 2] * 3 + [(rotation + slip * (turn + distance)) ** 2] * 3
        )
        motion[:3, 3] *= self._scale.value
        self._last_motion = motion
        return np.asarray(self.pose @ motion)

    def learn(self, guess: Array, pose: Array, found: Match) -> None:
        """Learn the scale of odometry, and how certain the pose is, from a match.

        Parameters
        ----------
        guess, pose
            Poses of the robot: by odometry, and by the match.
        found
            The match of the cloud.
        """
        if self.pose is not None:
            matched = pose[:3, 3] - self.pose[:3, 3]
            counted = (guess[:3, 3] - self.pose[:3, 3]) / self._scale.value
            position = self.covariance[:3, :3]
            self._scale.add(matched, counted, found.information[:3, :3], position)
        self.covariance = np.linalg.inv(np.linalg.inv(self.covariance) + found.information)

    def move_to(self, pose: Array, stamp_ns: int, odometry: Array) -> None:
        """Continue from a pose of the robot in the map, and that in the frame of odometry."""
        self.pose, self._stamp_ns, self._odometry = pose, stamp_ns, odometry
