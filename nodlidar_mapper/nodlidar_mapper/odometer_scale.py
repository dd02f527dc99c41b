"""The share by which odometry counts distances too long or too short, learned from matches."""

from nodlidar_mapper.poses import Array
import numpy as np

PRIOR_DISTANCE = 1.0  # distance that counts for a scale of 1 [m]
MEMORY = 50.0  # distance over which the scale may change [m]


class OdometerScale:
    """Compares the distances of odometry with those of matched clouds.

    Where matches do not show the motion, as along a corridor, they count little.

    Attributes
    ----------
    value
        True distance over that of odometry.
    """

    def __init__(self) -> None:
        self.value = 1.0
        self._true = self._counted = PRIOR_DISTANCE

    def add(self, matched: Array, counted: Array, information: Array, covariance: Array) -> None:
        """Learn from a motion.

        Parameters
        ----------
        matched, counted
            Motion of the robot by the match and by odometry [m], in the same frame, shape (3,).
        information
            Of the match, without odometry, shape (3, 3).
        covariance
            Of the position by odometry, before the match, shape (3, 3).
        """
        distance = float(np.linalg.norm(counted))
        if distance < 0.01:
            return
        along = counted / distance
        seen, known = along @ information @ along, 1.0 / (along @ covariance @ along)
        share = (seen / (seen + known)) ** 2
        memory = np.exp(-distance / MEMORY)
        self._true = memory * self._true + share * float(matched @ along)
        self._counted = memory * self._counted + share * distance
        self.value = self._true / self._counted
