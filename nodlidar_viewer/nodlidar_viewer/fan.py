"""The scan plane as a mesh: a fan of triangles from the optical centre to what the beams hit."""

import numpy as np
from numpy.typing import NDArray

EVERY = 4  # beams of which one is drawn


def fan(
    ranges: NDArray[np.float32],
    angle_min: float,
    angle_increment: float,
    nearest: float,
    farthest: float,
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return the vertices [m], shape (n, 3), and the triangles, shape (m, 3), of a scan.

    The triangles are those of any scan with so many beams, so that only vertices have to be sent.
    A beam without a range or azimuth ends in the centre, and so its triangles have no area.

    Parameters
    ----------
    ranges
        Shape (k,) [m]; those that are not from `nearest` to `farthest` do not count.
    angle_min, angle_increment
        Azimuth of the first beam [rad], and from beam to beam [rad].
    nearest, farthest
        Least and greatest range [m].
    """
    chosen = np.arange(0, len(ranges), EVERY)
    length = ranges[chosen]
    length = np.where((length >= nearest) & (length <= farthest), length, 0.0)
    angle = angle_min + angle_increment * chosen
    ends = np.stack([length * np.cos(angle), length * np.sin(angle), np.zeros_like(angle)], axis=1)
    ends[~np.isfinite(ends).all(axis=1)] = 0.0
    vertices = np.concatenate([np.zeros((1, 3)), ends]).astype(np.float32)
    first = np.arange(1, len(chosen))
    triangles = np.stack([np.zeros_like(first), first, first + 1], axis=1)
    return vertices, triangles.astype(np.uint32)
