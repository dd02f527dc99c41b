"""How odometry counts wrong, learned from matches."""

from nodlidar_mapper.linear import solved
from nodlidar_mapper.poses import Array, planar, yaw_of
import numpy as np

MEMORY = 50.0  # distance over which the errors may change [m]
# Before any match: standard deviations of scale, of turns as a share, and of curvature [rad/m].
SCALE_ERROR, TURN_ERROR, CURVATURE = 0.03, 0.03, 0.02
MATCH_ERROR = 0.005  # of the motion between two matches, at least [m], [rad]
LEAST_DISTANCE = 0.01  # with a direction [m]
UP = np.array([0.0, 0.0, 1.0])


class Odometer:
    """Compares the motions of odometry with those of matched clouds.

    Wheels that slip count too far. If one of them is larger than the other, the robot turns by a
    share of the distance without odometry knowing. Where matches show the motion badly, as along a
    corridor, they count little.

    Attributes
    ----------
    scale
        True distance over that of odometry.
    turn_error, curvature
        What the true turn is more than that of odometry: as a share of the turn, and per distance
        forwards [rad/m].
    """

    def __init__(self) -> None:
        self.scale, self.turn_error, self.curvature = 1.0, 0.0, 0.0
        self._scale_information, self._scale_pull = 0.0, 0.0
        self._turn_information, self._turn_pull = np.zeros((2, 2)), np.zeros(2)

    def corrected(self, motion: Array) -> Array:
        """Return a motion of odometry as it truly was, in the frame of the robot before."""
        further = self.turn_error * yaw_of(motion) + self.curvature * motion[0, 3]
        half = planar(0.0, 0.0, further / 2.0)  # on average along the way
        result = motion.copy()
        result[:3, 3] *= self.scale
        return np.asarray(half @ result @ half)

    def add(self, counted: Array, matched: Array, information: Array, covariance: Array) -> None:
        """Learn from a motion, in the frame of the robot before.

        Parameters
        ----------
        counted, matched
            Motion of the robot by odometry and by the match, as matrices.
        information
            Of the match, without odometry, shape (6, 6).
        covariance
            Of the pose before the motion, shape (6, 6).
        """
        distance = float(np.linalg.norm(counted[:3, 3]))
        memory = np.exp(-distance / MEMORY)
        if distance >= LEAST_DISTANCE:
            along = counted[:3, 3] / distance
            weight = _weight(along, information[:3, :3], covariance[:3, :3])
            further = float(matched[:3, 3] @ along) - distance
            self._scale_information = memory * self._scale_information + weight * distance**2
            self._scale_pull = memory * self._scale_pull + weight * distance * further
            self.scale = 1.0 + self._scale_pull / (self._scale_information + SCALE_ERROR**-2)
        turn = yaw_of(counted)
        causes = np.array([turn, counted[0, 3]])
        further = np.remainder(yaw_of(matched) - turn + np.pi, 2.0 * np.pi) - np.pi
        weight = _weight(UP, information[3:, 3:], covariance[3:, 3:])
        self._turn_information = memory * self._turn_information + weight * np.outer(
            causes, causes
        )
        self._turn_pull = memory * self._turn_pull + weight * further * causes
        prior = np.diag([TURN_ERROR**-2, CURVATURE**-2])
        errors = solved(self._turn_information + prior, self._turn_pull)
        self.turn_error, self.curvature = errors.tolist()


def _weight(direction: Array, information: Array, covariance: Array) -> float:
    """Return how certain a motion is in a direction: the inverse of its variance."""
    seen = direction @ information @ direction
    known = direction @ covariance @ direction + MATCH_ERROR**2
    return float(seen / (1.0 + seen * known))
