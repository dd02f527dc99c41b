"""How odometry counts wrong, learned from matches."""

from nodlidar_mapper.linear import solved
from nodlidar_mapper.poses import Array, planar, yaw_of
import numpy as np

MEMORY = 50.0  # distance over which the errors may change [m]
PRIOR_DISTANCE = 1.0  # distance that counts for a scale of 1 [m]
TURN_PRIOR = np.diag([0.03**-2, 0.02**-2])  # information on the errors of turns, before any match
TURN_NOISE = 0.005  # of a match [rad]
LEAST_DISTANCE = 0.01  # with a direction [m]
UP = np.array([0.0, 0.0, 1.0])


class Odometer:
    """Compares the motions of odometry with those of matched clouds.

    Wheels that slip count too far. If one of them is larger than the other, the robot turns by a
    share of the distance without odometry knowing. Where matches do not show the motion, as along
    a corridor, they count little.

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
        self._true = self._counted = PRIOR_DISTANCE
        self._information, self._pull = np.zeros((2, 2)), np.zeros(2)

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
            Of the pose by odometry, before the match, shape (6, 6).
        """
        distance = float(np.linalg.norm(counted[:3, 3]))
        memory = np.exp(-distance / MEMORY)
        if distance >= LEAST_DISTANCE:
            along = counted[:3, 3] / distance
            share = _seen(along, information[:3, :3], covariance[:3, :3])
            self._true = memory * self._true + share * float(matched[:3, 3] @ along)
            self._counted = memory * self._counted + share * distance
            self.scale = self._true / self._counted
        turn = yaw_of(counted)
        causes = np.array([turn, counted[0, 3]])
        further = np.remainder(yaw_of(matched) - turn + np.pi, 2.0 * np.pi) - np.pi
        weight = _seen(UP, information[3:, 3:], covariance[3:, 3:]) / TURN_NOISE**2
        self._information = memory * self._information + weight * np.outer(causes, causes)
        self._pull = memory * self._pull + weight * further * causes
        errors = solved(self._information + TURN_PRIOR, self._pull)
        self.turn_error, self.curvature = errors.tolist()


def _seen(direction: Array, information: Array, covariance: Array) -> float:
    """Return how far a match shows a direction, which odometry knows as well, 0 to 1."""
    seen, known = direction @ information @ direction, 1.0 / (direction @ covariance @ direction)
    return float((seen / (seen + known)) ** 2)
