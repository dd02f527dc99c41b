"""How late odometry is, by how sharp the clouds of turns are."""

from collections.abc import Sequence
from itertools import pairwise
import math

from nodlidar_assembler.clouds.ego_motion import (
    Odometry,
    OdometryConfig,
    OdometryError,
    rotated_back,
)
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from scipy.spatial.transform import Rotation

LONGEST, STEP = 0.5, 0.025  # of the delays that are tried [s]
# Edge of the cubes [m], oblique: walls along them would lie between two.
CUBE, OBLIQUE = 0.1, Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix()
PAIRS, LEAST_PAIRS = 40, 10  # of successive clouds
POINTS = 4000  # of a pair, about: more do not make the delay more certain
AROUND = 2  # delays to either side of the lowest one, to which a parabola is fitted
SAMPLES = 200  # of the pairs, by which the standard error is known
NOISE = 1e-3  # of an entropy, at least: where the robot stands, none is the lowest
KNOWN_ERROR = 0.05  # standard error with which the delay is known, at most [s]
# A delay that is worth a parameter has at least this size [s], and this many standard errors.
LEAST_DELAY, SURE = 0.03, 2.5


def odometry_delay(
    clouds: Sequence[Points], odometry: Odometry, limits: OdometryConfig
) -> tuple[float, float]:
    """Return by how much the stamps of odometry are late, and the standard error [s].

    Two successive clouds show the same walls. Late odometry bends both where the robot begins or
    ceases to turn, and places them beside each other. So their points are placed anew, each by
    odometry at its instant and a delay. With the right one, they fill cubes of space most
    unevenly: their entropy is lowest. No map is needed, in which the robot might be lost.

    The pairs in which the robot turns least steadily are taken; the standard error is that among
    random samples of them (bootstrap). A robot that never turns, or always alike, shows no delay:
    the error is then large, and infinite for a few clouds.

    Parameters
    ----------
    clouds
        Deskewed clouds.
    odometry
        Of the clouds' frame, by which they were deskewed.
    limits
        Of its motion: pairs with a jump nearby do not count.
    """
    pairs = [pair for pair in pairwise(clouds) if _is_known(pair, odometry, limits)]
    pairs = sorted(pairs, key=lambda pair: _unsteadiness(pair, odometry, limits))[-PAIRS:]
    if len(pairs) < LEAST_PAIRS:
        return 0.0, np.inf
    steps = round(LONGEST / STEP)
    delays = STEP * np.arange(-steps, steps + 1)
    blur = np.array([_entropies(pair, odometry, limits, delays) for pair in pairs])
    alike = np.full(len(pairs), 1.0 / len(pairs))
    rng = np.random.default_rng(0)
    samples = rng.multinomial(len(pairs), alike, SAMPLES) @ blur
    samples += rng.normal(0.0, NOISE * np.sqrt(len(pairs)), samples.shape)
    error = np.std([_lowest(delays, each) for each in samples])
    return _lowest(delays, blur.sum(axis=0)), float(error)


def is_worth_setting(delay: float, error: float) -> bool:
    """Return whether a delay with a standard error [s] should be taken out."""
    return error <= KNOWN_ERROR and abs(delay) >= max(LEAST_DELAY, SURE * error)


def _is_known(pair: tuple[Points, Points], odometry: Odometry, limits: OdometryConfig) -> bool:
    """Return whether there is odometry for each delay, without a jump."""
    margin_ns = round(LONGEST * NS_PER_S)
    ends_ns = np.array([pair[0].time_ns[0] - margin_ns, pair[1].time_ns[-1] + margin_ns])
    try:
        odometry.at(ends_ns, limits)
    except OdometryError:
        return False
    return True


def _unsteadiness(
    pair: tuple[Points, Points], odometry: Odometry, limits: OdometryConfig
) -> float:
    """Return by how much the heading by odometry deviates from a steady turn [rad]."""
    instants_ns = np.linspace(pair[0].time_ns[0], pair[1].time_ns[-1], 50).astype(np.int64)
    turned = Rotation.from_quat(odometry.at(instants_ns, limits).orientation).as_matrix()
    heading = np.unwrap(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))
    return float(np.abs(heading - np.linspace(heading[0], heading[-1], 50)).max())


def _entropies(
    pair: tuple[Points, Points], odometry: Odometry, limits: OdometryConfig, delays: Array
) -> Array:
    """Return how evenly the points of two clouds fill cubes, by odometry with each delay, (k,)."""
    times_ns = np.concatenate([cloud.time_ns for cloud in pair])
    points = np.concatenate([_as_measured(cloud, odometry, limits) for cloud in pair])
    thinned = slice(None, None, math.ceil(len(points) / POINTS))
    times_ns, points = times_ns[thinned], points[thinned]
    middle = len(points) // 2  # whose pose stays: the cubes do not move with the delay

    def entropy(delay: float) -> float:
        poses = odometry.at(times_ns + round(delay * NS_PER_S), limits)
        placed = poses.to_parent(points) - poses.position[middle]
        turn = Rotation.from_quat(poses.orientation[middle]).as_matrix() @ OBLIQUE
        keys = np.floor(placed @ turn / CUBE).astype(np.int64) @ np.array([1 << 42, 1 << 21, 1])
        _, count = np.unique(keys, return_counts=True)
        return -float(count @ np.log(count)) / len(points)

    return np.array([entropy(delay) for delay in delays])


def _as_measured(cloud: Points, odometry: Odometry, limits: OdometryConfig) -> Array:
    """Return the points of a deskewed cloud, each in its frame at the point's instant, (n, 3)."""
    placed = odometry.at(np.array([cloud.stamp_ns]), limits).to_parent(cloud.xyz)
    poses = odometry.at(cloud.time_ns, limits)
    return rotated_back(poses.orientation, placed - poses.position)


def _lowest(delays: Array, blur: Array) -> float:
    """Return where the parabola around the lowest value has its minimum."""
    lowest = int(np.clip(np.argmin(blur), AROUND, len(delays) - 1 - AROUND))
    near = slice(lowest - AROUND, lowest + AROUND + 1)
    bend, slope, _ = np.polyfit(delays[near] - delays[lowest], blur[near], 2)
    if bend <= 0.0:
        return float(delays[lowest])
    return float(delays[lowest] + np.clip(-slope / (2.0 * bend), -STEP, STEP))
