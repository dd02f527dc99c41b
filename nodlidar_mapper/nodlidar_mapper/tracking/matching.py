"""Matches a cloud to a surface: point to plane, with odometry as prior.

Gauss-Newton on the distances of points to the planes at their nearest neighbours, with Cauchy
weights. A point does not match a plane that it would be behind: the other side of a wall.
Directions that no surface shows, as along a corridor or over a bare floor, keep the odometry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from nodlidar_common.arrays import Array, Mask
from nodlidar_common.parameters import parameter
from nodlidar_mapper.geometry.linear import solved
from nodlidar_mapper.geometry.poses import change_between, corrected, lever
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface
import numpy as np

FREEDOMS = {'planar': [0, 1, 5], 'spatial': [0, 1, 2, 3, 4, 5]}
ITERATIONS = 20
CONVERGED = 1e-4  # m, rad
LEAST_MATCHED = 20
SHOWN = 0.2  # standard deviation of a direction that a match shows, at most [m], [rad]
# A normal may be wrong by this [rad]: by noise, and by errors of the lidar that come along with
# the robot, as where a floor seems to rise around it. X-ICP (Tuna et al. 2022) takes 10 degrees.
TILT = 0.2
# If wheels may have slipped, errors of odometry are Student's t with this few degrees of freedom,
# and weights begin this many times narrower than the reach: a wall that is far off still pulls.
TAILS, WIDE = 4.0, 8.0
CORRELATION = 30.0  # points of a cloud err alike: this many count as one


@dataclass(frozen=True)
class MatchingConfig:
    """Matching."""

    freedom: str = parameter(
        'planar',
        'planar: x, y and yaw are estimated, the others are those of odometry; spatial: all six',
        choices=tuple(FREEDOMS),
    )
    range_error: float = parameter(
        0.01,
        'Standard deviation of points off their surface',
        unit='m',
        minimum=0.001,
        maximum=1.0,
    )
    reach: float = parameter(
        0.4,
        'Farthest surface that a point may belong to',
        unit='m',
        minimum=0.05,
        maximum=5.0,
    )

    @property
    def free(self) -> list[int]:
        """Indices of the coordinates of a pose that are estimated."""
        return FREEDOMS[self.freedom]


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """A cloud matched to a surface.

    Attributes
    ----------
    pose
        Of the cloud's frame, as a matrix.
    information
        Inverse covariance of the change from the guess, without the prior, shape (6, 6).
    near_share
        Share of the points that are near the surface.
    share
        Share of these that lie on it.
    informative_share
        The same share of the points that show the pose: without those on bare planes, as a floor,
        that fit anywhere, but with those that are not near the surface.
    residual
        RMS distance from the surface of the points that lie on it [m].
    cost
        How improbable the points and the way from the guess are, where wheels may slip: the
        negative logarithm, up to a constant.
    prior_weight
        Share of its information with which the prior counted, 0 to 1; 1 unless wheels may have
        slipped.
    on
        Which points lie on the surface, shape (n,).
    """

    pose: Array
    information: Array
    near_share: float
    share: float
    informative_share: float
    residual: float
    cost: float
    prior_weight: float
    on: Mask

    @classmethod
    def none(cls, guess: Array, count: int) -> Match:
        """Return that of a cloud of so many points that is not near any surface."""
        nothing = np.zeros(count, np.bool_)
        return cls(guess, np.zeros((6, 6)), 0.0, 0.0, 0.0, np.inf, np.inf, 1.0, nothing)

    def shown(self, free: Sequence[int]) -> int:
        """Return in how many directions of the free coordinates the surface shows the pose."""
        strength = np.linalg.eigvalsh(self.information[np.ix_(free, free)])
        return int(np.count_nonzero(strength > SHOWN**-2))


def match(
    seen: Seen,
    surface: Surface,
    guess: Array,
    prior: Array,
    config: MatchingConfig,
    reach: float | None = None,
    start: Array | None = None,
    slip_time: float | None = None,
) -> Match:
    """Return where a cloud fits a surface, each point on the side from which it was seen.

    Parameters
    ----------
    seen
        In the cloud's frame.
    surface
        In the frame of the map.
    guess
        Pose of the cloud's frame by odometry.
    prior
        Inverse covariance of the guess, shape (6, 6).
    config
        Parameters.
    reach
        Farthest surface that a point may belong to at first [m]; by default that of the config.
    start
        Pose that the search starts from; by default the guess.
    slip_time
        Time for which wheels may have slipped evenly until the instant of the cloud, which bent
        it [s]; 0 if they slipped before the cloud. The more the surfaces then contradict the
        prior, the less it counts. None if wheels hold.
    """
    free, noise = config.free, config.range_error
    pose = start = guess if start is None else start
    reach = reach or config.reach
    slips = slip_time is not None
    width = reach / WIDE if slips else noise
    surface = surface.visible(seen.moved(start))
    nothing, fit = Match.none(start, len(seen.points)), None
    if not len(surface.points):
        return nothing
    shares = seen.shares(slip_time or 0.0)
    for _ in range(ITERATIONS):
        change = change_between(guess, pose)
        here = seen.slipped(guess, change, shares) if slip_time else seen.moved(pose)
        distance, nearest = surface.tree.query(here.points, distance_upper_bound=reach)
        near = np.isfinite(distance)
        normals = surface.normals.take(nearest, axis=0, mode='clip')
        near &= np.einsum('ni,ni->n', normals, here.towards) > 0.0
        if np.count_nonzero(near) < LEAST_MATCHED:
            break  # at the border of the map; the step before counts
        on, normal = here.points[near], normals[near]
        residuals = np.einsum('ni,ni->n', on - surface.points[nearest[near]], normal)
        weight = 1.0 / (1.0 + (residuals / (2.0 * width)) ** 2) / noise**2 / CORRELATION
        points = on - pose[:3, 3]
        information, pull, shows = _equations(
            points, normal, weight, residuals, shares[near], free
        )
        far = float(change @ prior @ change)
        prior_weight = min((TAILS + len(free)) / (TAILS + far), 1.0) if slips else 1.0
        pull -= prior_weight * (prior @ change)
        step = np.zeros(6)
        step[free] = solved((information + prior_weight * prior)[np.ix_(free, free)], pull[free])
        fit = _Fit(near, residuals, shows, information, far, prior_weight)
        pose = corrected(pose, step)
        if np.abs(step).max() < CONVERGED and width == noise:
            break
        reach = max(0.7 * reach, config.reach / 2.0)
        width = max(0.5 * width, noise)
    return nothing if fit is None else _judged(fit, pose, config)


class _Fit(NamedTuple):
    """A step of the search: which points are near the surface, (n,), and of those, (m,), the rest.

    residuals are their distances from it [m], shows whether they show the pose; far is the squared
    distance of the pose from the guess, by the prior.
    """

    near: Mask
    residuals: Array
    shows: Mask
    information: Array
    far: float
    prior_weight: float


def _judged(fit: _Fit, pose: Array, config: MatchingConfig) -> Match:
    """Return the match of the last step, which led to a pose."""
    near, residuals, free, noise = fit.near, fit.residuals, config.free, config.range_error
    fits = near.copy()
    fits[near] = np.abs(residuals) < 5.0 * noise
    judged = np.count_nonzero(fit.shows) + np.count_nonzero(~near)
    away = np.full(len(near), config.reach / 2.0)
    away[near] = residuals
    cost = 2.0 / CORRELATION * float(np.log1p((away / (2.0 * noise)) ** 2).sum())
    cost += (TAILS + len(free)) / 2.0 * float(np.log1p(fit.far / TAILS))
    return Match(
        pose,
        fit.information,
        near_share=float(np.mean(near)),
        share=float(np.mean(fits[near])),
        informative_share=np.count_nonzero(fits[near] & fit.shows) / max(judged, 1),
        residual=float(np.sqrt(np.mean(residuals[fits[near]] ** 2))) if fits.any() else np.inf,
        cost=cost,
        prior_weight=fit.prior_weight,
        on=fits,
    )


def _equations(
    points: Array, normals: Array, weight: Array, residuals: Array, shares: Array, free: list[int]
) -> tuple[Array, Array, Mask]:
    """Return the information (6, 6) about the pose, what pulls it (6,), and which points show it.

    A motion of the robot moves a point within the plane that it matches, or out of it. Only what
    leaves the plane at more than TILT counts, in each principal direction of the motion.

    Parameters
    ----------
    points, normals
        From the robot to the points [m], and normals of their planes, shape (n, 3).
    weight, residuals
        Of each point, and its distance from its plane [m], shape (n,).
    shares
        Of the motion, by which each point moves, shape (n,).
    free
        Indices of the coordinates that are estimated.
    """
    middle = points.mean(axis=0)  # wherever the sensor is on the robot
    way = points - middle
    arm = float(np.sqrt(np.mean(np.einsum('ni,ni->n', way, way))))
    unit = np.array([1.0, 1.0, 1.0, 1.0 / arm, 1.0 / arm, 1.0 / arm])[free]
    jacobian = np.concatenate([normals, np.cross(way, normals)], axis=1)[:, free] * unit
    _, axes = np.linalg.eigh((jacobian.T * weight) @ jacobian)
    motions = np.zeros((len(free), 6))
    motions[:, free] = (unit[:, None] * axes).T
    turns = np.cross(motions[:, 3:], np.eye(3)[:, None])  # moves a point by its way (3, k, 3)
    moves = motions[:, :3] + np.einsum('ni,ikj->nkj', way, turns)  # of each point (n, k, 3)
    leaves = jacobian @ axes
    surely = 1.0 - TILT**2 * np.einsum('nki,nki->nk', moves, moves) / np.maximum(leaves**2, 1e-12)
    leaves *= shares[:, None]
    counted = weight[:, None] * leaves * np.maximum(surely, 0.0)
    directions = np.zeros((6, len(free)))
    directions[free] = axes / unit[:, None]
    directions = lever(middle).T @ directions
    information = (directions * np.einsum('nk,nk->k', counted, leaves)) @ directions.T
    pull = -directions @ np.einsum('n,nk->k', residuals, counted)
    return information, pull, (surely > 0.0).any(axis=1)
