"""The method: match each cloud to the map around, extend the map, close loops."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

from nodlidar_common.errors import ParameterError
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.linear import inverted
from nodlidar_mapper.geometry.poses import Array, carried, inverse, lever, moved, turning
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.geometry.surface import Surface, surface_of
from nodlidar_mapper.graph.keyframe import Estimate, Keyframe, surface_in_map
from nodlidar_mapper.graph.loops import around, loop_at
from nodlidar_mapper.graph.pose_graph import Edge, optimized, pose_covariances, step
from nodlidar_mapper.recovery.place_search import ALIKE, clear_share
from nodlidar_mapper.recovery.recovery import Guess, Recovery
from nodlidar_mapper.tracking.matching import Match, match
from nodlidar_mapper.tracking.track import Track
import numpy as np

FIRST = 5  # clouds that are mapped again with what they have shown of odometry
RECENT = 6  # clouds from which new surfaces are taken
LEAST_SURFACE = 100  # points of a map that clouds are matched to
FOUND = np.diag([1e2] * 6)  # information of a place that was searched, at least
FARTHEST = 1000.0  # m
NO_MAP = 'no map yet'
MAPPED = 0.9  # share of the points; below it, the map is extended
# Wheels may have slipped far if so much less of a cloud fits than of those before. The newest one
# has this weight in their average.
UNUSUAL, NEWEST = 1.0 / 3.0, 0.3


@dataclass(frozen=True, slots=True, eq=False)
class _Cloud:
    """A cloud as it was added, see Mapper.add."""

    stamp_ns: int
    points: Array
    odometry: Array
    mount: Array
    age: Array | None

    @property
    def robot(self) -> tuple[int, Array]:
        """Its stamp [ns], and the pose of the robot in the frame of odometry."""
        return self.stamp_ns, self.odometry @ inverse(self.mount)


class Mapper:
    """Takes deskewed clouds and odometry; keeps keyframes in a pose graph.

    Parameters
    ----------
    config
        Parameters.
    keyframes, edges
        Of a map to be continued, in which the robot may be anywhere; by default, a new one begins.

    Attributes
    ----------
    keyframes, edges
        The map.
    loops
        Number of loops closed.

    Raises
    ------
    ParameterError
        If there is no map and none may be made.
    """

    def __init__(
        self,
        config: MapConfig,
        keyframes: Sequence[Keyframe] = (),
        edges: Sequence[Edge] = (),
    ) -> None:
        if not keyframes and not config.extend_map:
            raise ParameterError('extend_map', 'true without a map (map_folder)', False)
        self._config = config
        self._estimated = np.zeros((6, 6))  # 1 where the covariance is, 0 elsewhere
        self._estimated[np.ix_(config.free, config.free)] = 1.0
        self.keyframes, self.edges = list(keyframes), list(edges)
        self.loops = 0
        self._covariances = self._keyframe_covariances()  # of the keyframes
        self._track = Track(config)
        self._usual_fit = 0.0  # mean informative_share of the matches so far
        self._recent: deque[Seen] = deque(maxlen=RECENT)  # in the map
        self._anchor = 0  # index of the keyframe nearest to the robot along the way
        self._local = Surface.joined([])
        self._map_from_odometry: Array | None = None  # the last good one
        self._recovery = Recovery(config, anywhere=bool(keyframes))
        # None once they were mapped again, or if there is nothing to begin.
        self._first: list[tuple[_Cloud, Estimate]] | None = None if keyframes else []
        self._again: dict[Estimate, Estimate] = {}  # of the first clouds
        if keyframes:
            self._choose_local(keyframes[0].pose)

    def add(
        self,
        stamp_ns: int,
        points: Array,
        odometry: Array,
        mount: Array | None = None,
        age: Array | None = None,
    ) -> Estimate:
        """Return where a cloud was taken, and extend the map if it shows anything new.

        Parameters
        ----------
        stamp_ns
            Instant of the cloud [ns].
        points
            In the cloud's frame [m], shape (n, 3).
        odometry
            Pose of the cloud's frame in the frame of odometry at that instant, as a matrix.
        mount
            Pose of the cloud's frame in that of the robot, where several sensors have their own;
            by default it is the same.
        age
            Time from each point's measurement to the instant of the cloud [s], shape (n,), by
            which errors of odometry are taken out of the deskewing.
        """
        mount = np.eye(4) if mount is None else mount
        cloud = _Cloud(stamp_ns, points, odometry, mount, age)
        estimate = self._added(cloud)
        if self._first is not None and len(self._local.points) >= LEAST_SURFACE:
            self._first.append((cloud, estimate))
        return estimate

    def place(self, pose: Array, stamp_ns: int, odometry: Array, covariance: Array) -> None:
        """Continue at a given pose, as a person sets it.

        Parameters
        ----------
        pose, stamp_ns, odometry
            Pose of the robot in the map at an instant [ns], and in the frame of odometry.
        covariance
            Of the pose's change, shape (6, 6).
        """
        self._first = None
        self._map_from_odometry = pose @ inverse(odometry)
        self._track.move_to(pose, stamp_ns, odometry)
        self._track.covariance = covariance
        if self.keyframes:
            places = np.stack([keyframe.pose[:3, 3] for keyframe in self.keyframes])
            self._anchor = int(np.argmin(np.linalg.norm(places - pose[:3, 3], axis=1)))
            self._choose_local(pose)
        self._recent.clear()
        self._recovery.forget()

    def poses_of(self, estimates: Sequence[Estimate]) -> Array:
        """Return where clouds were taken, by the map as it is now, shape (n, 4, 4)."""
        latest = [self._again.get(each, each) for each in estimates]
        keyframes = np.stack([self.keyframes[each.keyframe].pose for each in latest])
        return np.asarray(keyframes @ np.stack([each.from_keyframe for each in latest]))

    def pose_of(self, estimate: Estimate) -> Array:
        """Return where a cloud was taken, by the map as it is now."""
        return np.asarray(self.poses_of([estimate])[0])

    def _added(self, cloud: _Cloud) -> Estimate:
        """Predict, match, check, search and extend, in the order of docs/mapping.md."""
        stamp_ns, odometry, mount = cloud.stamp_ns, cloud.odometry, cloud.mount
        robot = inverse(mount)  # in the cloud's frame
        predicted = self._track.predicted(stamp_ns, odometry @ robot)
        guess = predicted @ mount
        way = guess[:3, 3] - predicted[:3, 3]  # from the robot to the cloud's frame
        covariance = carried(self._track.covariance, way)
        seen = self._seen(cloud)
        found = self._matched(seen, guess, covariance, self._track.halfway @ mount)
        lost = self._lost(found, seen)
        if not lost:
            of_robot = lever(way).T @ found.information @ lever(way)
            self._track.learn(found.pose @ robot, of_robot, found.prior_weight)
        elif lost != NO_MAP and self._first is not None:
            self._begin_anew()
            lost = NO_MAP
        elif lost != NO_MAP:
            found, lost = self._searched(cloud, seen, guess, covariance, found, lost)
        if self._first is not None and len(self._first) == FIRST - 1:
            return self._begun_again(self._first, cloud)
        begins, pose = lost == NO_MAP, guess if lost else found.pose
        if not lost or begins:
            self._recent.append(seen.moved(pose))
            placed = carried(self._track.covariance, way)
            pose = self._grown(stamp_ns, pose, placed, seen, begins, found.mapped)
        self._track.move_to(pose @ robot, stamp_ns, odometry @ robot)
        if not lost or begins:
            self._map_from_odometry = pose @ inverse(odometry)
        return Estimate(
            stamp_ns,
            pose,
            self._map_from_odometry,
            self._estimated * self._covariance_at(pose @ robot),
            found.share,
            found.residual,
            lost,
            self._anchor,
            inverse(self.keyframes[self._anchor].pose) @ pose,
        )

    def _begun_again(self, first: list[tuple[_Cloud, Estimate]], newest: _Cloud) -> Estimate:
        """Map the first clouds again, and the newest one; return its estimate.

        Their points were deskewed, and their poses predicted, by odometry with unknown errors.
        """
        self._first = None
        clouds = [*(cloud for cloud, _ in first), newest]
        self._track = self._track.before([cloud.robot for cloud in clouds])
        self._forget_surfaces()
        if self.keyframes[0].stamp_ns == first[0][0].stamp_ns:
            self.keyframes, self._covariances = [], []
        for cloud, before in first:
            self._again[before] = self._added(cloud)
        return self._added(newest)

    def _begin_anew(self) -> None:
        """Begin the map with the newest cloud: the first ones, badly deskewed, do not fit."""
        assert self._first is not None
        self._forget_surfaces()
        back = inverse(self.keyframes[0].pose)
        for _, before in self._first:
            self._again[before] = replace(before, keyframe=0, from_keyframe=back @ before.pose)
        self._first.clear()
        self._track.covariance = Track(self._config).covariance

    def _forget_surfaces(self) -> None:
        """Keep the first keyframe alone, from which the places so far are known."""
        empty = Surface.joined([])
        self.keyframes = [
            replace(each, surface=empty, points=empty.points) for each in self.keyframes[:1]
        ]
        self.edges, self.loops, self._anchor, self._near = [], 0, 0, [0]
        self._covariances = self._keyframe_covariances()
        self._local = empty
        self._recent.clear()

    def _seen(self, cloud: _Cloud) -> Seen:
        """Return the points of a cloud in its frame, without the errors of odometry."""
        mount, age = cloud.mount, np.zeros(len(cloud.points)) if cloud.age is None else cloud.age
        seen = self._track.seen(moved(mount, cloud.points), age, mount[:3, 3])
        seen = seen.moved(inverse(mount))
        seen = seen[(np.abs(seen.points) < FARTHEST).all(axis=1)]  # NaN is not
        return seen.thinned(self._config.point_spacing)

    def _matched(self, seen: Seen, guess: Array, covariance: Array, halfway: Array) -> Match:
        """Match a cloud, as if wheels had slipped where that is more probable."""
        if not len(self._local.points):
            return Match.none(guess, len(seen.points))
        prior = inverted(covariance)
        found = match(seen, self._local, guess, prior, self._config)
        usual = self._usual_fit
        self._usual_fit += NEWEST * (found.informative_share - usual)
        # What the first clouds show of odometry is no slip: it is learned.
        if self._first is not None or self._track.jump:
            return found
        starts = [guess] if found.share < ALIKE else []
        if found.informative_share < UNUSUAL * usual:
            starts.append(halfway)
        slipped = [
            match(seen, self._local, guess, prior, self._config, slips=True, start=start)
            for start in starts
        ]
        return min([found, *slipped], key=lambda each: each.cost)

    def _lost(self, found: Match, seen: Seen) -> str:
        """Return why a match is not believed; empty if it is."""
        if len(self._local.points) < LEAST_SURFACE:
            return NO_MAP
        if found.share < self._config.least_share:
            return f'{found.share:.0%} of the points near the map lie on it'
        near = [self.keyframes[i] for i in self._near]
        clear = clear_share(seen.points, found.pose, near, found.on)
        if clear < self._config.least_clear:
            return f'{1.0 - clear:.0%} of the points are in space that was seen to be free'
        return self._recovery.doubt(found, clear)

    def _searched(
        self,
        cloud: _Cloud,
        seen: Seen,
        guess: Array,
        covariance: Array,
        failed: Match,
        lost: str,
    ) -> tuple[Match, str]:
        """Search for the robot; return the match and why it is still lost."""
        here = Guess(guess, covariance, bool(self._track.jump), self._track.paused)
        if self._recovery.is_beyond(seen, here, failed, self.keyframes):
            return replace(failed, pose=guess, mapped=0.0), ''
        found = self._recovery.search(seen, here, cloud.odometry, self.keyframes)
        if isinstance(found, str):
            return failed, '; '.join(filter(None, [self._track.jump, lost, found]))
        back = (found.pose @ inverse(cloud.mount))[:3, 3] - found.pose[:3, 3]  # to the robot
        of_robot = carried(inverted(found.information + FOUND), back)
        self.place(found.pose, 0, cloud.odometry, of_robot)
        return found, ''

    def _is_new(self, pose: Array) -> bool:
        """Return whether the robot is away from the nearest keyframe of the map around."""
        here = np.stack([self.keyframes[i].pose for i in self._near])
        way = np.linalg.norm(here[:, :3, 3] - pose[:3, 3], axis=1)
        turned = np.einsum('nij,ij->n', here[:, :3, :3], pose[:3, :3])
        turn = np.arccos(np.clip((turned - 1.0) / 2.0, -1.0, 1.0))
        config = self._config
        measure = way / config.keyframe_distance + turn / config.keyframe_angle
        nearest = int(np.argmin(measure))
        if self._near[nearest] != self._anchor:
            self._anchor = self._near[nearest]
            self._choose_local(pose)
        return bool(measure[nearest] > 1.0)

    # The map.

    def _grown(
        self,
        stamp_ns: int,
        pose: Array,
        covariance: Array,
        seen: Seen,
        begins: bool,
        mapped: float,
    ) -> Array:
        """Extend the map if a cloud shows anything new; return its pose, by a loop if closed."""
        is_new = not self.keyframes or (not begins and self._is_new(pose))
        if not self._config.extend_map:
            return pose
        if is_new:
            self._add_keyframe(stamp_ns, pose, covariance, seen.points, mapped)
            self._extend(pose)
            if self._close_loop():
                return self.keyframes[-1].pose
        elif begins or mapped < MAPPED:
            self._extend(pose)
        return pose

    def _add_keyframe(
        self, stamp_ns: int, pose: Array, covariance: Array, points: Array, mapped: float
    ) -> None:
        self.keyframes.append(Keyframe(stamp_ns, pose, Surface.joined([]), points))
        last, accumulated = len(self.keyframes) - 1, np.zeros((6, 6))
        if last:
            anchor = self.keyframes[self._anchor].pose
            relative = inverse(anchor) @ pose
            # The clouds within map_radius are matched to the same map, whose error they share.
            way = float(np.linalg.norm(relative[:3, 3]))
            share = min(way / self._config.map_radius, 1.0) if mapped else 1.0
            turn = turning(anchor[:3, :3])
            error = share * covariance
            self.edges.append(step(self._anchor, last, relative, turn.T @ error @ turn))
            along = pose[:3, 3] - anchor[:3, 3]
            accumulated = carried(self._covariances[self._anchor], along) + error
        self._covariances.append(accumulated)
        self._anchor = last

    def _keyframe_covariances(self) -> list[Array]:
        """Return the covariances of the keyframes' poses, relative to where the map began."""
        if not self.keyframes:
            return []
        poses = np.stack([keyframe.pose for keyframe in self.keyframes])
        return list(pose_covariances(poses, self.edges, self._config.free))

    def _covariance_at(self, robot: Array) -> Array:
        """Return the covariance of the robot's pose: in the map around, and of that map."""
        way = robot[:3, 3] - self.keyframes[self._anchor].pose[:3, 3]
        of_map = carried(self._covariances[self._anchor], way)
        return np.asarray(of_map + self._track.covariance)

    def _extend(self, pose: Array) -> None:
        """Add the surfaces that the map does not have yet to the nearest keyframe."""
        spacing, known = self._config.point_spacing, self._local
        seen = Seen.joined(self._recent)
        fresh = seen.thinned(spacing)
        fresh = fresh[~known.covers(fresh, spacing)]
        around = Seen.joined([seen, Seen(known.points, known.points + known.normals)])
        surface = surface_of(fresh, around)
        keyframe = self.keyframes[self._anchor]
        added = surface.moved(inverse(keyframe.pose))
        joined = Surface.joined([keyframe.surface, added])
        self.keyframes[self._anchor] = replace(keyframe, surface=joined)
        self._choose_local(pose)

    def _choose_local(self, pose: Array) -> None:
        """Choose the part of the map around that is near along the way."""
        self._near = around(self._anchor, pose, self.keyframes, self.edges, self._config)
        self._local = surface_in_map([self.keyframes[i] for i in self._near])

    # Loops.

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
        self._choose_local(poses[-1])
        return True
