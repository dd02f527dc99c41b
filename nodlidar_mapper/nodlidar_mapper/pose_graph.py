"""Poses of keyframes from relative poses between them, by sparse least squares."""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_mapper.poses import Array, change_between, corrected, inverse
import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve

ITERATIONS = 20
CONVERGED = 1e-5  # m, rad
MATCHED = 0.005  # error of the way between keyframes whose clouds were matched, as a share


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A keyframe as another one sees it.

    Attributes
    ----------
    start, end
        Indices of the keyframes.
    relative
        Pose of the end in the frame of the start, as a matrix.
    information
        Inverse covariance of its change, shape (6, 6).
    """

    start: int
    end: int
    relative: Array
    information: Array


def optimized(poses: Array, edges: Sequence[Edge], free: Sequence[int]) -> Array:
    """Return the poses (n, 4, 4) that fit the edges best; the first one stays.

    Gauss-Newton; edges that are far off count less, as with a soft L1 loss.

    Parameters
    ----------
    poses
        Poses to start from.
    edges
        They join all poses.
    free
        Indices of the coordinates of a pose's change in the map (x, y, z and turns) that may
        change. The frames of the poses may have any tilt.
    """
    start = np.array([edge.start for edge in edges])
    end = np.array([edge.end for edge in edges])
    relative = np.stack([edge.relative for edge in edges])
    information = np.stack([edge.information for edge in edges])
    size = len(free)
    for _ in range(ITERATIONS):
        seen = inverse(poses[start]) @ poses[end]
        error = change_between(relative, seen)
        off = np.einsum('ei,eij,ej->e', error, information, error)
        weighted = information / np.sqrt(1.0 + off)[:, None, None]
        at_start, at_end = _jacobians(poses[start], poses[end])
        jacobian = bsr_matrix(
            (
                np.stack([at_start, at_end], axis=1)[..., free].reshape(-1, 6, size),
                np.stack([start, end], axis=1).ravel(),
                np.arange(0, 2 * len(edges) + 1, 2),
            ),
            shape=(6 * len(edges), size * len(poses)),
        ).tocsr()[:, size:]
        blocks = np.arange(len(edges) + 1)
        weights = bsr_matrix((weighted, blocks[:-1], blocks))
        normal = (jacobian.T @ weights @ jacobian).tocsc()
        solved = spsolve(normal, -(jacobian.T @ (weights @ error.ravel())))
        change = np.zeros((len(poses), 6))
        change[1:, free] = solved.reshape(-1, size)
        poses = corrected(poses, change)
        if np.abs(solved).max() < CONVERGED:
            break
    return poses


def step(start: int, end: int, relative: Array, error: float = MATCHED) -> Edge:
    """Return the edge between neighbouring keyframes, whose error grows by a share of the way."""
    way = float(np.linalg.norm(relative[:3, 3]))
    shift, turn = 0.004 + error * way, 0.001 + error / 5.0 * way
    return Edge(start, end, relative, np.diag([shift**-2] * 3 + [turn**-2] * 3))


def _jacobians(start: Array, end: Array) -> tuple[Array, Array]:
    """Return how relative poses, in the frame of the start, change with both, shapes (n, 6, 6)."""
    back = np.swapaxes(start[:, :3, :3], 1, 2)
    x, y, z = (end[:, :3, 3] - start[:, :3, 3]).T
    across = np.zeros_like(back)
    across[:, 0, 1], across[:, 0, 2], across[:, 1, 2] = -z, y, -x
    across -= np.swapaxes(across, 1, 2)
    at_end = np.zeros((len(start), 6, 6))
    at_end[:, :3, :3] = at_end[:, 3:, 3:] = back
    at_start = -at_end
    at_start[:, :3, 3:] = back @ across
    return at_start, at_end


def distances_from(index: int, poses: Array, edges: Sequence[Edge]) -> Array:
    """Return the lengths of the shortest ways along edges to all keyframes [m]; inf without."""
    length = [float(np.linalg.norm(edge.relative[:3, 3])) + 1e-3 for edge in edges]
    start, end = [edge.start for edge in edges], [edge.end for edge in edges]
    graph = csr_matrix((length, (start, end)), shape=(len(poses), len(poses)))
    return np.asarray(dijkstra(graph, directed=False, indices=index))
