"""Poses of a graph, against the poses that its edges were made of, and brute-force ways."""

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_mapper.geometry.poses import change_between, corrected, inverse, planar
from nodlidar_mapper.graph.pose_graph import distances_from, Edge, optimized, pose_covariances
from nodlidar_mapper.tracking.matching import FREEDOMS
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

CERTAIN = np.diag([1e4] * 3 + [1e6] * 3)


def ring(count, radius=5.0):
    """Return poses around a circle, each looking along it."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return np.stack(
        [planar(radius * np.cos(a), radius * np.sin(a), a + np.pi / 2) for a in angles]
    )


def edges_of(poses, pairs):
    return [Edge(i, j, inverse(poses[i]) @ poses[j], CERTAIN) for i, j in pairs]


MOUNTS = {  # of the lidar on the robot: turns about x, y, z [rad]
    'level': (0.0, 0.0, 0.0),
    'tilted': (0.0, 0.4, 0.3),
    'on its side': (np.pi / 2.0, 0.0, 0.0),
    'upside down': (np.pi, 0.0, 0.0),
}


def mount(name):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler('xyz', MOUNTS[name]).as_matrix()
    pose[:3, 3] = 0.3, -0.1, 0.8
    return pose


@settings(max_examples=40)
@given(
    st.integers(3, 30),
    st.integers(0, 99),
    st.sampled_from(['planar', 'spatial']),
    st.sampled_from(list(MOUNTS)),
)
def test_exact_edges_give_the_exact_poses_back(count, seed, freedom, mounted):
    truth, free = ring(count) @ mount(mounted), FREEDOMS[freedom]
    change = np.zeros((count, 6))
    change[1:, free] = np.random.default_rng(seed).normal(0.0, 0.05, (count - 1, len(free)))
    pairs = [(k, k + 1) for k in range(count - 1)] + [(count - 1, 0)]
    found = optimized(corrected(truth, change), edges_of(truth, pairs), free)
    np.testing.assert_allclose(found, truth, atol=1e-4)


def test_a_closed_loop_spreads_the_drift():
    truth = ring(40)
    edges = edges_of(truth, [(k, k + 1) for k in range(39)])
    drift = planar(0.01, 0.0, 0.004)
    drifting = [Edge(e.start, e.end, e.relative @ drift, e.information) for e in edges]
    poses = [truth[0]]
    for edge in drifting:
        poses.append(poses[-1] @ edge.relative)
    poses = np.stack(poses)
    closed = optimized(poses, [*drifting, *edges_of(truth, [(39, 0)])], FREEDOMS['planar'])
    before, after = (
        np.linalg.norm((each - truth)[:, :2, 3], axis=1).max() for each in (poses, closed)
    )
    assert after < 0.35 * before


def test_an_edge_far_off_counts_less_than_by_its_square():
    truth = ring(20)
    edges = edges_of(truth, [(k, k + 1) for k in range(19)])
    wrong = Edge(0, 10, inverse(truth[0]) @ truth[10] @ planar(0.5, 0, 0), CERTAIN)
    found = optimized(truth, [*edges, *edges_of(truth, [(0, 10), (2, 12)]), wrong], [0, 1, 5])
    assert np.linalg.norm((found - truth)[:, :2, 3], axis=1).max() < 0.17  # a third of it


@given(st.integers(2, 7), st.data())
def test_distances_are_the_shortest_of_all_ways(count, data):
    poses = ring(count)
    pairs = [(k, k + 1) for k in range(count - 1)]
    extra = st.tuples(st.integers(0, count - 1), st.integers(0, count - 1))
    pairs += [pair for pair in data.draw(st.lists(extra, max_size=4)) if pair[0] < pair[1]]
    length = np.full((count, count), np.inf)
    np.fill_diagonal(length, 0.0)
    for i, j in pairs:
        length[i, j] = length[j, i] = np.linalg.norm((poses[i] - poses[j])[:3, 3])
    for k in range(count):  # Floyd and Warshall
        length = np.minimum(length, length[:, k, None] + length[None, k])
    found = distances_from(0, poses, edges_of(poses, pairs))
    np.testing.assert_allclose(found, length[0], atol=0.01)


def test_an_edge_of_which_little_is_known_is_a_long_way():
    """As one by odometry that was silent, between two parts of a map."""
    poses = ring(6)
    edges = edges_of(poses, [(k, k + 1) for k in range(5)])
    unknown = np.diag([10.0**-2, 10.0**-2, 1e4, 1e6, 1e6, 1.0])
    edges[2] = Edge(2, 3, edges[2].relative, unknown)
    way = distances_from(0, poses, edges)
    assert way[2] < 15.0
    np.testing.assert_array_less(900.0, way[3:])
    turn = np.kron(np.eye(2), mount('tilted')[:3, :3])  # of a planar loop, by a tilted lidar
    flat = turn @ np.diag([1e4, 1e4, 0.0, 0.0, 0.0, 1e6]) @ turn.T
    edges[2] = Edge(2, 3, edges[2].relative, flat)
    assert distances_from(0, poses, edges)[3] < 20.0


@given(st.tuples(*[st.floats(-0.5, 0.5)] * 6))
def test_a_change_between_poses_makes_one_of_the_other(change):
    start = planar(1.0, -2.0, 0.7)
    end = corrected(start, np.array(change))
    np.testing.assert_allclose(change_between(start, end), change, atol=1e-9)


def test_an_error_of_the_heading_grows_along_the_way():
    """Ten steps of 2 m ahead, each with an error of the heading of 1 mrad alone."""
    way = np.stack([planar(2.0 * k, 0.0, 0.0) for k in range(11)]) @ mount('tilted')
    heading = np.diag([1e12, 1e12, 1e12, 1e12, 1e12, 1e6])
    free = FREEDOMS['planar']
    for forwards in (True, False):
        edges = []
        for k in range(10):
            start, end = (k, k + 1) if forwards else (k + 1, k)
            turn = np.kron(np.eye(2), way[start][:3, :3])
            relative = inverse(way[start]) @ way[end]
            edges.append(Edge(start, end, relative, turn.T @ heading @ turn))
        found = pose_covariances(way, edges, free)
        assert not found[0].any()
        np.testing.assert_allclose(np.sqrt(found[:, 5, 5]), 1e-3 * np.sqrt(np.arange(11)), 1e-3)
        # The turn of each step shifts the end by what is left of the way.
        left = 2.0 * np.arange(10) + (0.0 if forwards else 2.0)
        assert np.sqrt(found[10][1, 1]) == pytest.approx(1e-3 * np.linalg.norm(left), rel=1e-3)


def test_a_loop_makes_the_map_more_certain():
    way = ring(20)
    pairs = [(k, k + 1) for k in range(19)]
    alone = pose_covariances(way, edges_of(way, pairs), FREEDOMS['planar'])
    closed = pose_covariances(way, edges_of(way, [*pairs, (0, 19)]), FREEDOMS['planar'])
    assert alone[19][5, 5] == pytest.approx(19e-6)
    assert closed[19][5, 5] == pytest.approx(1e-6)
    assert closed[10][5, 5] == pytest.approx(10e-6)


def test_the_poses_of_a_noisy_loop_cost_no_more_than_those_of_another_solver():
    """The same soft L1 cost, least by scipy, with derivatives by differences."""
    rng, free = np.random.default_rng(0), FREEDOMS['planar']
    information = np.diag([1e3] * 3 + [3e3] * 3)
    noise = np.zeros((7, 6))
    noise[:, free] = rng.normal(0.0, [0.03, 0.03, 0.02], (7, 3))
    truth, pairs = ring(7), [(k, (k + 1) % 7) for k in range(7)]
    edges = [
        Edge(i, j, corrected(inverse(truth[i]) @ truth[j], noise[i]), information)
        for i, j in pairs
    ]
    start = [truth[0]]
    for edge in edges[:-1]:
        start.append(start[-1] @ edge.relative)

    def residuals(poses):
        off = [
            change_between(edge.relative, inverse(poses[edge.start]) @ poses[edge.end])
            for edge in edges
        ]
        square = np.array([each @ information @ each for each in off])
        return np.sqrt(2.0 * (np.sqrt(1.0 + square) - 1.0))

    def of_change(flat):
        change = np.zeros((7, 6))
        change[1:, free] = flat.reshape(6, 3)
        return residuals(corrected(np.stack(start), change))

    best = least_squares(of_change, np.zeros(18), max_nfev=100)
    found = optimized(np.stack(start), edges, free)
    assert np.sum(residuals(found) ** 2) < 2.0 * best.cost + 1e-3
