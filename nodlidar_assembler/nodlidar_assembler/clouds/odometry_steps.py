"""The motion between successive odometry samples: straight, at constant turn rate (SLERP).

Between unit quaternions q0 and q1 whose half turn is h, SLERP (Shoemake 1985) is
q(u) = cos(u h) q0 + sin(u h) p with p = (q1 - cos(h) q0) / sin(h), orthogonal to q0.
"""

from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray

# Replaces smaller half turns [rad], whose sine equals the angle to the last bit: avoids 0 / 0.
LEAST_HALF_TURN = 1e-9


class Steps:
    """The k motions between k + 1 samples of a frame's pose.

    Parameters
    ----------
    time_ns
        Stamps [ns], strictly ascending, shape (k + 1,).
    position, orientation
        Positions [m], shape (k + 1, 3); unit quaternions x, y, z, w, shape (k + 1, 4), each in the
        hemisphere of the one before.

    Attributes
    ----------
    motion
        Duration [s], speed [m/s] and turn rate [rad/s] of each step, shape (3, k).
    """

    def __init__(self, time_ns: Times, position: Array, orientation: Array) -> None:
        gap_ns = time_ns[1:] - time_ns[:-1]
        here, there = orientation[:-1], orientation[1:]
        half_turn = 2.0 * np.arcsin(0.5 * lengths(there - here))  # exact near zero as well
        half = np.maximum(half_turn, LEAST_HALF_TURN)
        cos, sin = np.cos(half)[:, None], np.sin(half)[:, None]
        self._time_ns = time_ns
        self._position, self._orientation = position.T, orientation.T
        self._velocity = (position[1:] - position[:-1]).T / gap_ns  # m/ns
        self._across = ((there - cos * here) / sin).T
        self._half_rate = half / gap_ns  # rad/ns
        self.motion = np.empty((3, len(gap_ns)))
        self.motion[0] = gap_ns / NS_PER_S
        self.motion[1] = lengths(self._velocity.T) * NS_PER_S
        self.motion[2] = 2.0 * half_turn / self.motion[0]

    def of(self, times_ns: Times) -> NDArray[np.intp]:
        """Return the index of the step that contains each instant [ns], shape (n,)."""
        return self._time_ns[1:-1].searchsorted(times_ns, side='right')

    def at(self, times_ns: Times, step: NDArray[np.intp]) -> tuple[Array, Array]:
        """Return positions (n, 3) and orientations (n, 4) at instants [ns] in their steps."""
        since = times_ns - self._time_ns.take(step)
        position = self._velocity.take(step, axis=1)
        position *= since
        position += self._position.take(step, axis=1)
        turned = since * self._half_rate.take(step)
        orientation = self._orientation.take(step, axis=1)
        orientation *= np.cos(turned)
        across = self._across.take(step, axis=1)
        across *= np.sin(turned)
        orientation += across
        return position.T, orientation.T


def lengths(vectors: Array) -> Array:
    """Return the lengths of vectors (n, k)."""
    return np.asarray(np.sqrt(dots(vectors, vectors)))


def dots(a: Array, b: Array) -> Array:
    """Return the dot products of vectors (n, k), row by row."""
    return np.asarray(np.einsum('ij,ij->i', a, b))
