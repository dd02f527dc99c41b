"""Poses of keyframes from relative poses between them, by sparse least squares."""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_mapper.geometry.linear import inverted, solved_each
from nodlidar_mapper.geometry.poses import (
    carried,
    change_between,
    corrected,
    inverse,
    turning,
)
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve

ITERATIONS = 20
CONVERGED = 1e-5  # m, rad
LEAST = np.diag([0.004**2] * 3 + [0.001**2] * 3)  # covariance of an edge [m^2], [rad^2]
# An edge with a larger error [m] counts as so much longer [m]: what nothing joins to the map but
# odometry that was silent is not part of the map around the robot, and is matched to it as a loop.
UNCERTAIN, FAR = 1.0, 1000.0
NO_INFORMATION = 1e-6  # 1/m^2; less is rounding


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


def step(start: int, end: int, relative: Array, covariance: Array) -> Edge:
    """Return the edge to a new keyframe, with the covariance of its change, shape (6, 6)."""
    return Edge(start, end, relative, inverted(covariance + LEAST))


def pose_covariances(poses: Array, edges: Sequence[Edge], free: Sequence[int]) -> Array:
    """Return the covariances of the poses' changes in the map, shape (n, 6, 6).

    The first pose is certain. From there, the errors of the edges add up along the shortest way.
    Arguments as in `optimized`.
    """
    found = np.zeros((len(poses), 6, 6))
    if not edges:
        return found
    errors = covariances_of(edges, poses, free)
    joins = {(each.start, each.end): error for each, error in zip(edges, errors, strict=True)}
    way, before = _shortest(0, poses, edges)
    for index in np.argsort(way)[1:]:
        last = before[index]
        along = poses[index][:3, 3] - poses[last][:3, 3]
        if (last, index) in joins:
            found[index] = carried(found[last], along) + joins[last, index]
        else:  # seen from the other end
            found[index] = carried(found[last] + joins[index, last], along)
    return found


def covariances_of(edges: Sequence[Edge], poses: Array, free: Sequence[int]) -> Array:
    """Return the covariances of the changes of the edges' ends in the map, shape (e, 6, 6)."""
    turn = turning(poses[[edge.start for edge in edges], :3, :3])
    information = turn @ np.stack([edge.information for edge in edges]) @ np.swapaxes(turn, 1, 2)
    rows, columns = np.ix_(free, free)
    known = information[:, rows, columns]
    covariances = np.zeros_like(information)
    covariances[:, rows, columns] = solved_each(
        known, np.broadcast_to(np.eye(len(free)), known.shape)
    )
    return covariances


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
    """Return the lengths of the shortest ways along edges to all keyframes [m]; inf without.

    An uncertain edge counts as longer by FAR.
    """
    return _shortest(index, poses, edges)[0]


def _errors(edges: Sequence[Edge]) -> Array:
    """Return the standard deviation of the place of each edge's end [m], the largest, (e,).

    Directions without information are not free.
    """
    information = np.array([edge.information[:3, :3] for edge in edges]).reshape(-1, 3, 3)
    known = np.linalg.eigvalsh(information)
    return np.asarray(np.where(known > NO_INFORMATION, known, np.inf).min(axis=1) ** -0.5)


def _shortest(index: int, poses: Array, edges: Sequence[Edge]) -> tuple[Array, NDArray[np.int32]]:
    """Return these lengths, and the keyframe before each one on its way."""
    ways = np.array([edge.relative[:3, 3] for edge in edges]).reshape(-1, 3)
    length = np.linalg.norm(ways, axis=1) + FAR * (_errors(edges) > UNCERTAIN) + 1e-3
    pairs = np.array([(edge.start, edge.end) for edge in edges], dtype=np.intp).reshape(-1, 2)
    order = np.argsort(length)  # of several edges of a pair, csr_matrix would take the sum
    _, shortest = np.unique((pairs @ [len(poses), 1])[order], return_index=True)
    chosen = order[shortest]
    graph = csr_matrix((length[chosen], pairs[chosen].T), shape=(len(poses), len(poses)))
    way, before = dijkstra(graph, directed=False, indices=index, return_predecessors=True)
    return np.asarray(way), np.asarray(before)
