"""The scan plane as a mesh: a fan of triangles from the optical centre to what the beams hit."""

import numpy as np
from numpy.typing import NDArray

EVERY = 4  # beams of which one is drawn


def fan(
    ranges: NDArray[np.float32], angle_min: float, angle_increment: float, nearest: float
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return the vertices [m], shape (n, 3), and the triangles, shape (m, 3), of a scan.

    Where one of two neighbouring beams has no range, there is no triangle.

    Parameters
    ----------
    ranges
        Shape (k,) [m]; those that are not finite, or nearer than `nearest` [m], do not count.
    angle_min, angle_increment
        Azimuth of the first beam [rad], and from beam to beam [rad].
    """
    chosen = np.arange(0, len(ranges), EVERY)
    length = np.where(np.isfinite(ranges[chosen]), ranges[chosen], 0.0)
    is_hit = length >= nearest
    angle = angle_min + angle_increment * chosen
    ends = np.stack([length * np.cos(angle), length * np.sin(angle), np.zeros_like(angle)], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), ends]).astype(np.float32)
    first = np.flatnonzero(is_hit[:-1] & is_hit[1:]) + 1
    triangles = np.stack([np.zeros_like(first), first, first + 1], axis=1)
    return vertices, triangles.astype(np.uint32)
