"""How odometry counts wrong, learned from matches."""

from nodlidar_common.arrays import Array
from nodlidar_mapper.geometry.linear import inverted, solved
from nodlidar_mapper.geometry.poses import corrected, yaw_of
import numpy as np

MEMORY = 50.0  # distance over which the errors may change [m]
CURVATURE = 2.0 / 3.0  # share of the slip that is a turn per distance, before any match [rad/m]
MATCH_ERROR = 0.005  # of the motion between two matches, at least [m], [rad]
UP = np.array([0.0, 0.0, 1.0])


class OdometryErrors:
    """Compares the motions of odometry with those of matched clouds.

    Wheels that slip count too far. If one of them is larger than the other, the robot turns by a
    share of the distance without odometry knowing. Where matches show the motion badly, as along a
    corridor, they count little.

    Parameters
    ----------
    slip
        Standard deviation of odometry as a share of the motion, before any match.

    Attributes
    ----------
    estimate
        What the true motion is more than that of odometry: as a share of the distance, as a share
        of the turn, and as a turn per distance ahead and to the left [rad/m], shape (4,).
    covariance
        Of these errors, shape (4, 4).
    """

    def __init__(self, slip: float) -> None:
        self._unknown = np.diag((slip * np.array([1.0, 1.0, CURVATURE, CURVATURE])) ** -2)
        self.estimate, self.covariance = np.zeros(4), inverted(self._unknown)
        self._information, self._pull = np.zeros((4, 4)), np.zeros(4)

    def corrected(self, motion: Array, up: Array = UP) -> Array:
        """Return a motion of odometry as it truly was, in the frame of the robot before.

        Odometry counts turns about the vertical, which was `up` there, a unit vector (3,).
        """
        longer, turns = self.estimate[0], self.estimate[1:]
        further = float(turns @ _causes(motion))
        half = further / 2.0 * up  # on average along the way
        result = motion.copy()
        result[:3, 3] *= 1.0 + longer
        return np.asarray(_turned(half) @ result @ _turned(motion[:3, :3].T @ half))

    def effect(self, motion: Array) -> Array:
        """Return what the errors add to a motion, in the frame of the robot before, (6, 4)."""
        x, y, _ = motion[:3, 3]
        effect = np.zeros((6, 4))
        effect[:3, 0] = motion[:3, 3]
        effect[5, 1:] = _causes(motion)
        effect[:2, 1:] = np.outer([-y, x], effect[5, 1:] / 2.0)
        return effect

    def add(
        self,
        counted: Array,
        change: Array,
        information: Array,
        before: Array,
        expected: Array,
        prior_weight: float = 1.0,
    ) -> None:
        """Learn from a motion, in the frame of the robot before.

        Parameters
        ----------
        counted
            Motion of the robot by odometry, as a matrix.
        change
            From the expected pose to the matched one, shape (6,).
        information
            Of the match, without odometry, shape (6, 6).
        before, expected
            Covariances of the pose before the motion, and of the expected one, shape (6, 6).
        prior_weight
            Share that is kept of what was learned before: wheels that slip count otherwise.
        """
        memory = prior_weight * np.exp(-float(np.linalg.norm(counted[:3, 3])) / MEMORY)
        effect = self.effect(counted)
        known = inverted(before + MATCH_ERROR**2 * np.eye(6))
        # The match without the expectation, which draws the pose towards itself.
        alone = information @ change + solved(expected, change)
        shown = np.column_stack([information @ effect, alone])
        weight = effect.T @ known @ solved(known + information, shown)
        self._information = memory * self._information + weight[:, :4]
        self._pull = memory * self._pull + weight[:, :4] @ self.estimate + weight[:, 4]
        self.covariance = inverted(self._information + self._unknown)
        self.estimate = self.covariance @ self._pull


def _turned(turn: Array) -> Array:
    return corrected(np.eye(4), np.concatenate([np.zeros(3), turn]))


def _causes(motion: Array) -> Array:
    """Return what turns odometry wrong in a motion: its turn, and ways ahead and to the left."""
    return np.array([yaw_of(motion), motion[0, 3], motion[1, 3]])
