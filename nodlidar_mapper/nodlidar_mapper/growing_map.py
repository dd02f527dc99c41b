"""The map while it grows: keyframes in a pose graph, and the part of them around the robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from nodlidar_common.arrays import Array
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import carried, inverse, turning
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface, surface_of
from nodlidar_mapper.graph.keyframe import Keyframe, surface_of_map
from nodlidar_mapper.graph.loops import indices_around, loop_at
from nodlidar_mapper.graph.pose_graph import Edge, optimized, pose_covariances, step
import numpy as np

RECENT = 6  # clouds from which new surfaces are taken
# A keyframe also shows what is free. That of a robot that stands may begin with a part of a sweep,
# so a cloud that has this many times as many points as the keyframes at its place is one, too.
MORE = 2.0
KNOWN = 0.9  # share of a cloud's points near the map; below it, the map is extended


class GrowingMap:
    """Takes clouds whose places are known; adds what is new, and closes loops.

    Parameters
    ----------
    config
        Parameters.
    keyframes, edges
        Of a map to be continued; by default, a new one begins.

    Attributes
    ----------
    keyframes, edges
        The map.
    loops
        Number of loops closed.
    anchor
        Index of the nearest keyframe, of those around.
    surface_around
        The surfaces near the robot along the path, to which clouds are matched.
    """

    def __init__(
        self, config: MapConfig, keyframes: Sequence[Keyframe] = (), edges: Sequence[Edge] = ()
    ) -> None:
        self._config = config
        self.keyframes, self.edges = list(keyframes), list(edges)
        self.loops = self.anchor = 0
        self.surface_around = Surface.joined([])
        self._indices_around = [0]
        self._covariances = self._keyframe_covariances()
        self._recent: deque[Seen] = deque(maxlen=RECENT)  # in the map
        if keyframes:
            self._choose_around(keyframes[0].pose)

    @property
    def points(self) -> int:
        """Number of points of all surfaces."""
        return sum(len(each.surface.points) for each in self.keyframes)

    @property
    def keyframes_around(self) -> list[Keyframe]:
        """Those near the robot along the path."""
        return [self.keyframes[i] for i in self._indices_around]

    def seen_around(self) -> Seen:
        """Return what the keyframes around have seen, in the frame of the map."""
        return Seen.joined([each.placed_cloud for each in self.keyframes_around])

    def go_to(self, pose: Array) -> None:
        """Continue at a pose that no way leads to."""
        self._recent.clear()
        if self.keyframes:
            places = np.stack([keyframe.pose[:3, 3] for keyframe in self.keyframes])
            self.anchor = int(np.argmin(np.linalg.norm(places - pose[:3, 3], axis=1)))
            self._choose_around(pose)

    def follow(self, pose: Array, points: int) -> bool:
        """Let the nearest keyframe be the anchor; return whether the map needs another one.

        It does for the first cloud at a place, and for one with MORE times as many points. Since
        each doubles them, a place has a few keyframes at most, however long the robot stands.
        """
        poses = np.stack([keyframe.pose for keyframe in self.keyframes_around])
        way = np.linalg.norm(poses[:, :3, 3] - pose[:3, 3], axis=1)
        turned = np.einsum('nij,ij->n', poses[:, :3, :3], pose[:3, :3])
        turn = np.arccos(np.clip((turned - 1.0) / 2.0, -1.0, 1.0))
        config = self._config
        measure = way / config.keyframe_distance + turn / config.keyframe_angle
        here = [self.keyframes_around[i] for i in np.flatnonzero(measure <= 1.0)]
        nearest = int(np.argmin(measure))
        if self._indices_around[nearest] != self.anchor:
            self.anchor = self._indices_around[nearest]
            self._choose_around(pose)
        return all(points > MORE * len(keyframe.cloud.points) for keyframe in here)

    def add(
        self,
        stamp_ns: int,
        pose: Array,
        covariance: Array,
        seen: Seen,
        robot: Array,
        begins: bool,
        near_share: float,
    ) -> Array:
        """Add what a cloud shows that is new; return its pose, by a loop if one is closed.

        Parameters
        ----------
        stamp_ns, pose, covariance
            Of the cloud.
        seen
            Its points, in its frame.
        robot
            Pose of the robot in that frame.
        begins
            Whether there is no map around yet.
        near_share
            Share of its points that are near the map.
        """
        self._recent.append(seen.moved(pose))
        is_new = not self.keyframes or (not begins and self.follow(pose, len(seen.points)))
        if not self._config.extend_map:
            return pose
        if is_new:
            nothing = Surface.joined([])
            cloud = replace(seen, age=None)
            self._add_keyframe(
                Keyframe(stamp_ns, pose, nothing, cloud, robot), covariance, near_share
            )
            self._extend(pose)
            if self._close_loop():
                return self.keyframes[-1].pose
        elif begins or near_share < KNOWN:
            self._extend(pose)
        return pose

    def forget(self) -> None:
        """Begin anew, without any keyframe."""
        self.keyframes = []
        self.forget_surfaces()

    def forget_surfaces(self) -> None:
        """Keep the first keyframe alone, from which the places so far are known."""
        empty = Surface.joined([])
        self.keyframes = [
            replace(each, surface=empty, cloud=Seen.joined([])) for each in self.keyframes[:1]
        ]
        self.edges, self.loops, self.anchor, self._indices_around = [], 0, 0, [0]
        self._covariances = self._keyframe_covariances()
        self.surface_around = empty
        self._recent.clear()

    def covariance_at(self, place: Array) -> Array:
        """Return the covariance of the map at a place (3,), relative to where it began, (6, 6)."""
        way = place - self.keyframes[self.anchor].pose[:3, 3]
        return carried(self._covariances[self.anchor], way)

    def _keyframe_covariances(self) -> list[Array]:
        """Return the covariances of the keyframes' poses, relative to where the map began."""
        if not self.keyframes:
            return []
        poses = np.stack([keyframe.pose for keyframe in self.keyframes])
        return list(pose_covariances(poses, self.edges, self._config.free))

    def _add_keyframe(self, keyframe: Keyframe, covariance: Array, near_share: float) -> None:
        self.keyframes.append(keyframe)
        pose = keyframe.pose
        last, accumulated = len(self.keyframes) - 1, np.zeros((6, 6))
        if last:
            anchor = self.keyframes[self.anchor].pose
            relative = inverse(anchor) @ pose
            # The clouds within map_radius are matched to the same map, whose error they share.
            way = float(np.linalg.norm(relative[:3, 3]))
            share = min(way / self._config.map_radius, 1.0) if near_share else 1.0
            turn = turning(anchor[:3, :3])
            error = share * covariance
            self.edges.append(step(self.anchor, last, relative, turn.T @ error @ turn))
            along = pose[:3, 3] - anchor[:3, 3]
            accumulated = carried(self._covariances[self.anchor], along) + error
        self._covariances.append(accumulated)
        self.anchor = last

    def _extend(self, pose: Array) -> None:
        """Add the surfaces that the map does not have yet to the nearest keyframe."""
        spacing, known = self._config.point_spacing, self.surface_around
        seen = Seen.joined(self._recent)
        fresh = seen.thinned(spacing)
        fresh = fresh[~known.covers(fresh, spacing)]
        beside = Seen.joined([seen, Seen(known.points, known.points + known.normals)])
        surface = surface_of(fresh, beside)
        keyframe = self.keyframes[self.anchor]
        added = surface.moved(inverse(keyframe.pose))
        joined = Surface.joined([keyframe.surface, added])
        self.keyframes[self.anchor] = replace(keyframe, surface=joined)
        self._choose_around(pose)

    def _choose_around(self, pose: Array) -> None:
        self._indices_around = indices_around(
            self.anchor, pose, self.keyframes, self.edges, self._config
        )
        self.surface_around = surface_of_map(self.keyframes_around)

    def _close_loop(self) -> bool:
        """Match the newest keyframe to an old part of the map; return whether it fits."""
        back = inverse(self.keyframes[-1].pose)
        seen = Seen.joined(self._recent).moved(back)
        edge = loop_at(seen, self.keyframes, self.edges, self._config)
        if edge is None:
            return False
        self.edges.append(edge)
        poses = np.stack([keyframe.pose for keyframe in self.keyframes])
        poses = optimized(poses, self.edges, self._config.free)
        self.keyframes = [
            replace(each, pose=pose) for each, pose in zip(self.keyframes, poses, strict=True)
        ]
        self.loops += 1
        self._covariances = self._keyframe_covariances()
        change = poses[-1] @ back
        self._recent = deque((each.moved(change) for each in self._recent), RECENT)
        self._choose_around(poses[-1])
        return True
