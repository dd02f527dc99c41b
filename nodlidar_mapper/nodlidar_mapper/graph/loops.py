"""Loops: the same place, seen again after a long way."""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_common.parameters import parameter
from nodlidar_mapper.geometry.poses import inverse, turning
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.graph.keyframe import Keyframe, surface_of_map
from nodlidar_mapper.graph.pose_graph import distances_from, Edge
from nodlidar_mapper.tracking.matching import match, MatchingConfig
import numpy as np

# A corner of the old part of the map fits elsewhere as well. So this share of the points must lie
# near that part, and that share of these must match.
LEAST_NEAR, LEAST_SHARE = 0.4, 0.6
REACH = 1.0  # m
THINNER = 2.0  # points of a loop are this many times farther apart than those of a cloud
DRIFT = 0.01  # error of the map, as a share of the way


@dataclass(frozen=True)
class LoopConfig(MatchingConfig):
    """Map around the robot, and loops."""

    point_spacing: float = parameter(
        0.1,
        'Distance between points of a cloud or of the map',
        unit='m',
        minimum=0.02,
        maximum=0.25,
    )
    map_radius: float = parameter(
        8.0, 'The map within this distance is matched', unit='m', minimum=1.0, maximum=100.0
    )
    loop_distance: float = parameter(
        15.0,
        'Parts of the map that are farther along the path are matched as a loop',
        unit='m',
        minimum=1.0,
        maximum=1000.0,
    )


def indices_around(
    index: int,
    pose: Array,
    keyframes: Sequence[Keyframe],
    edges: Sequence[Edge],
    config: LoopConfig,
) -> list[int]:
    """Return the indices of keyframes near a pose, also near one of them along the path."""
    poses = np.stack([keyframe.pose for keyframe in keyframes])
    way = distances_from(index, poses, edges)
    near = np.linalg.norm(poses[:, :3, 3] - pose[:3, 3], axis=1) < config.map_radius
    near[index] = True
    return [int(each) for each in np.flatnonzero(near & (way < config.loop_distance))]


def loop_at(
    seen: Seen, keyframes: Sequence[Keyframe], edges: Sequence[Edge], config: LoopConfig
) -> Edge | None:
    """Return the edge from the nearest keyframe that is far along the path to the newest one.

    Parameters
    ----------
    seen
        The latest clouds, in the frame of the newest keyframe.
    keyframes, edges
        Of the map.
    config
        Parameters.
    """
    here, last = keyframes[-1], len(keyframes) - 1
    poses = np.stack([keyframe.pose for keyframe in keyframes])
    way = distances_from(last, poses, edges)
    distance = np.linalg.norm(poses[:, :3, 3] - here.pose[:3, 3], axis=1)
    distance[way < config.loop_distance] = np.inf
    nearest = int(np.argmin(distance))
    if distance[nearest] > config.map_radius / 2.0:
        return None
    seen = seen.thinned(THINNER * config.point_spacing)
    old = surface_of_map(
        [keyframes[i] for i in indices_around(nearest, here.pose, keyframes, edges, config)]
    )
    if old.covers(seen.moved(here.pose), REACH).mean() < LEAST_NEAR:
        return None
    drift = DRIFT * way[nearest]
    prior = np.diag([drift**-2] * 3 + [(0.2 * drift) ** -2] * 3)
    found = match(seen, old, here.pose, prior, config, REACH)
    # A bare floor fits everywhere. Along a corridor, the way between both places is not known.
    fits = found.share >= LEAST_SHARE and found.near_share >= LEAST_NEAR
    if not fits or found.shown(config.free) < len(config.free):
        return None
    turn = turning(poses[nearest][:3, :3].T)
    information = turn @ found.information @ turn.T
    return Edge(nearest, last, inverse(poses[nearest]) @ found.pose, information)
