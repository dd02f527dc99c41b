"""Floors that are level and walls that are upright, by which the zero of the joint shows."""

from dataclasses import dataclass, replace
import math

from nodlidar_common.arrays import Array
import numpy as np

# At first and in the end [rad]:
OFF_LEVEL = 0.1, 0.03  # a plane farther off is neither a floor nor a wall,
DOUBTED = 0.03, 3e-3  # ... and one this far off counts half
SPREAD = 3e-4  # of floors and walls [rad]


@dataclass(frozen=True, slots=True)
class Level:
    """Floors, ceilings and walls are level and upright.

    Attributes
    ----------
    up
        Upward in nodlidar_base_link, shape (3,).
    limit
        Angle by which a plane may be off and still count [rad].
    doubted
        Angle off at which it counts half [rad].
    """

    up: Array
    limit: float = OFF_LEVEL[0]
    doubted: float = DOUBTED[0]

    def narrower(self) -> 'Level':
        """Return it for planes that are nearer to level than before."""
        limit = max(OFF_LEVEL[1], 0.5 * self.limit)
        return replace(self, limit=limit, doubted=max(DOUBTED[1], 0.3 * self.doubted))

    def weight(self, residuals: Array) -> Array:
        """Return the weights of residuals [rad]."""
        return np.asarray(SPREAD**-2.0 / (1.0 + (residuals / self.doubted) ** 2))

    @property
    def axis(self) -> Array:
        """Horizontal axis across that of the nod: about it the base may be tilted."""
        across = np.cross([0.0, 1.0, 0.0], self.up)
        return np.asarray(across / np.linalg.norm(across))

    def residuals(self, normal: Array, tilt: float) -> list[tuple[float, float, Array]]:
        """Return how far a plane is off level or upright [rad], for a tilt of the base [rad].

        Parameters
        ----------
        normal
            Of the plane, shape (3,).
        tilt
            About the axis.

        Returns
        -------
        Each residual, its derivative by the tilt, and that by the normal, shape (3,).
        """
        tipped = np.cross(self.axis, self.up)
        up = self.up + tilt * tipped
        height = float(normal @ up)
        if abs(height) < self.limit:
            return [(height, float(normal @ tipped), up)]
        if abs(height) < math.cos(self.limit):
            return []
        side, ahead = math.copysign(1.0, height), np.cross(up, self.axis)
        by_tilt = side * float(normal @ np.cross(tipped, self.axis))
        return [
            (side * float(normal @ self.axis), 0.0, side * self.axis),
            (side * float(normal @ ahead), by_tilt, side * ahead),
        ]
