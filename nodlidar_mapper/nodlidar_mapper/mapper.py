"""The method: match each cloud to the map around the robot, extend the map, find a lost robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.linear import inverted
from nodlidar_mapper.geometry.poses import carried, inverse, lever, moved
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.graph.keyframe import Estimate, Keyframe
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.graph.pose_graph import Edge
from nodlidar_mapper.growing_map import GrowingMap
from nodlidar_mapper.recovery.place_search import clear_share
from nodlidar_mapper.recovery.recovery import Guess, Recovery
from nodlidar_mapper.tracking.matching import Match, match
from nodlidar_mapper.tracking.track import Track
import numpy as np

FIRST = 5  # clouds that are mapped again with what they have shown of odometry
LEAST_SURFACE = 100  # points of a map that clouds are matched to
FOUND = np.diag([1e2] * 6)  # information of a place that was searched, at least
FARTHEST = 1000.0  # m
NO_MAP = 'no map yet'
FITS = 0.94  # share of a cloud on the map, from which on wheels have not slipped
# Wheels may have slipped far if so much less of a cloud fits than of those before. The newest one
# has this weight in their average.
UNUSUAL, NEWEST = 1.0 / 3.0, 0.3
SLIPPED = 0.5, 1.5  # shares of the motion that are tried then
STRAIGHTENED = 4  # times that a cloud is straightened by the slip that it showed before, at most
STRAIGHTER = 0.95  # of the cost is left, or it is not done again
# Clouds that slips have bent lie on the map in part, where the robot is not. A match is not
# believed if the share that lies on it is less than this of the usual one.
LEAST_OF_USUAL = 0.6


class Mapper:
    """Takes deskewed clouds and odometry; keeps keyframes in a pose graph.

    Parameters
    ----------
    config
        Parameters.
    keyframes, edges
        Of a map to be continued, in which the robot may be anywhere; by default, a new one begins.
    searches
        Whether a robot that is lost is searched for.

    Attributes
    ----------
    map
        The map.

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
        searches: bool = True,
    ) -> None:
        if not keyframes and not config.extend_map:
            raise ParameterError('extend_map', 'true without a map (map_folder)', False)
        self._config = config
        self._free = np.zeros((6, 6))  # 1 where the covariance is, 0 elsewhere
        self._free[np.ix_(config.free, config.free)] = 1.0
        self.map = GrowingMap(config, keyframes, edges)
        self._track = Track(config)
        self._usual_fit = 0.0  # sliding mean of informative_share
        self._usual_share = 0.0  # and of share
        self._map_from_odometry: Array | None = None  # the last good one
        self._recovery = Recovery(config, anywhere=bool(keyframes))
        self._searches = searches
        self._since_lost: Mapper | None = None  # maps anew while the robot is lost
        # None once they were mapped again, or if there is nothing to begin.
        self._first: list[tuple[Cloud, Estimate]] | None = None if keyframes else []
        self._again: dict[Estimate, Estimate] = {}  # of the first clouds
        # What the first clouds show of odometry is no slip: it is learned.
        self._may_slip = bool(keyframes)
        self._was_placed = False  # by a person, and no cloud was matched since

    def add(self, cloud: Cloud) -> Estimate:
        """Return where a cloud was taken, and extend the map if it shows anything new."""
        estimate = self._processed(cloud)
        if self._first is not None and self._has_surface:
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
        self._first, self._may_slip = None, True
        self._map_from_odometry = pose @ inverse(odometry)
        self._track.move_to(pose, stamp_ns, odometry)
        self._track.covariance = covariance
        self.map.go_to(pose)
        self._recovery.forget()
        self._since_lost = None
        self._was_placed = True

    def poses_of(self, estimates: Sequence[Estimate]) -> Array:
        """Return where clouds were taken, by the map as it is now, shape (n, 4, 4)."""
        latest = [self._again.get(each, each) for each in estimates]
        keyframes = np.stack([self.map.keyframes[each.keyframe].pose for each in latest])
        return np.asarray(keyframes @ np.stack([each.from_keyframe for each in latest]))

    def path_of(self, estimates: Sequence[Estimate]) -> Array:
        """Return where the robot was when clouds were taken, see `poses_of`."""
        robots = np.stack([each.robot for each in estimates])
        return np.asarray(self.poses_of(estimates) @ robots)

    def snapshot(self, estimates: Sequence[Estimate]) -> MapSnapshot:
        """Return the map and the path along estimates, the last of which is that of now."""
        return MapSnapshot(
            estimates[-1],
            list(self.map.keyframes),
            list(self.map.edges),
            self.map.loops,
            [each.stamp_ns for each in estimates],
            self.path_of(estimates),
        )

    @property
    def _has_surface(self) -> bool:
        """Whether there is enough of a map around to match a cloud to."""
        return len(self.map.surface_around.points) >= LEAST_SURFACE

    def _processed(self, cloud: Cloud) -> Estimate:
        """Predict, match, check, search and extend, in the order of docs/mapping.md."""
        robot = inverse(cloud.mount)  # in the cloud's frame
        predicted = self._track.predicted(*cloud.robot, cloud.silence)
        if self._track.jump and self._track.paused and self._first is None:
            # Nothing says how far it went meanwhile: what looks alike may be anywhere.
            self._recovery = Recovery(self._config, anywhere=True)
        guess = predicted @ cloud.mount
        way = guess[:3, 3] - predicted[:3, 3]  # from the robot to the cloud's frame
        covariance = carried(self._track.covariance, way)
        seen = self._seen(cloud)
        found, seen = self._matched(cloud, seen, guess, covariance)
        lost = self._why_lost(found, seen)
        if self._has_surface:
            self._usual_share += NEWEST * (found.share - self._usual_share)
        if not lost:
            self._recovery.forget()
            self._was_placed = False
            self._since_lost = None
            of_robot = lever(way).T @ found.information @ lever(way)
            self._track.learn(found.pose @ robot, of_robot, found.prior_weight)
        elif lost != NO_MAP and self._first is not None:
            self._begin_anew()
            lost = NO_MAP
        elif lost != NO_MAP and self._searches:
            found, lost = self._searched(cloud, seen, guess, covariance, found, lost)
        if self._first is not None and len(self._first) == FIRST - 1:
            return self._begun_again(self._first, cloud)
        begins, pose = lost == NO_MAP, guess if lost else found.pose
        if not lost or begins:
            placed = carried(self._track.covariance, way)
            near = found.near_share
            pose = self.map.add(cloud.stamp_ns, pose, placed, seen, robot, begins, near)
            self._map_from_odometry = pose @ inverse(cloud.odometry)
        self._track.move_to(pose @ robot, *cloud.robot)
        return self._estimate(cloud.stamp_ns, pose, robot, found, lost)

    def _estimate(
        self, stamp_ns: int, pose: Array, robot: Array, found: Match, lost: str
    ) -> Estimate:
        """Return a cloud's estimate, from its pose and that of the robot in the cloud's frame."""
        here = (pose @ robot)[:3, 3]
        return Estimate(
            stamp_ns,
            pose,
            self._map_from_odometry,
            self._free * (self.map.covariance_at(here) + self._track.covariance),
            found.share,
            found.residual,
            lost,
            self.map.anchor,
            inverse(self.map.keyframes[self.map.anchor].pose) @ pose,
            robot,
        )

    def _begun_again(self, first: list[tuple[Cloud, Estimate]], newest: Cloud) -> Estimate:
        """Map the first clouds again, and the newest one; return its estimate.

        Their points were deskewed, and their poses predicted, by odometry with unknown errors.
        """
        self._first = None
        clouds = [*(cloud for cloud, _ in first), newest]
        self._track = self._track.restarted([cloud.robot for cloud in clouds])
        if self.map.keyframes[0].stamp_ns == first[0][0].stamp_ns:
            self.map.forget()
        else:
            self.map.forget_surfaces()
        for cloud, before in first:
            self._again[before] = self._processed(cloud)
        estimate = self._processed(newest)
        self._may_slip = True
        return estimate

    def _begin_anew(self) -> None:
        """Begin the map with the newest cloud: the first ones, badly deskewed, do not fit."""
        assert self._first is not None
        self.map.forget_surfaces()
        back = inverse(self.map.keyframes[0].pose)
        for _, before in self._first:
            self._again[before] = replace(before, keyframe=0, from_keyframe=back @ before.pose)
        self._first.clear()
        self._track.covariance = Track(self._config).covariance

    def _seen(self, cloud: Cloud, slip: Array | None = None) -> Seen:
        """Return the points of a cloud in its frame, without the errors of odometry."""
        mount, age = cloud.mount, np.zeros(len(cloud.points)) if cloud.age is None else cloud.age
        seen = self._track.seen(moved(mount, cloud.points), age, mount[:3, 3], slip)
        seen = seen.moved(inverse(mount))
        seen = seen[(np.abs(seen.points) < FARTHEST).all(axis=1)]  # NaN is not
        return seen.thinned(self._config.point_spacing)

    def _matched(
        self, cloud: Cloud, seen: Seen, guess: Array, covariance: Array
    ) -> tuple[Match, Seen]:
        """Match a cloud, as if wheels had slipped where that is more probable.

        Return the match, and the points as matched: without the bend of the slip.
        """
        if not len(self.map.surface_around.points):
            return Match.none(guess, len(seen.points)), seen
        prior = inverted(covariance)
        found = match(seen, self.map.surface_around, guess, prior, self._config)
        usual = self._usual_fit
        self._usual_fit += NEWEST * (found.informative_share - usual)
        if not self._may_slip or self._track.jump:
            return found, seen
        matches = [(found, seen)]
        if found.share < FITS:
            matches += self._matched_with_slip(cloud, seen, guess, prior, guess)
        best = min(matches, key=_cost)
        is_bad = best[0].share < LEAST_OF_USUAL * self._usual_share
        if is_bad or found.informative_share < UNUSUAL * usual:
            for share in SLIPPED:
                start = self._track.moved_by(share) @ cloud.mount
                matches += self._matched_with_slip(cloud, seen, guess, prior, start)
        return min(matches, key=_cost)

    def _matched_with_slip(
        self, cloud: Cloud, seen: Seen, guess: Array, prior: Array, start: Array
    ) -> Iterator[tuple[Match, Seen]]:
        """Match a cloud as if wheels had slipped before it, and as if evenly throughout it."""
        matched = partial(
            match,
            surface=self.map.surface_around,
            guess=guess,
            prior=prior,
            config=self._config,
        )
        before = matched(seen, start=start, slip_time=0.0)
        yield before, seen
        found, cost = matched(seen, start=start, slip_time=self._track.interval), before.cost
        for _ in range(STRAIGHTENED):
            if found.cost > STRAIGHTER * cost:
                return
            cost = found.cost
            seen = self._seen(cloud, self._track.slip_to(found.pose @ inverse(cloud.mount)))
            found = matched(seen, start=found.pose, slip_time=0.0)
            yield found, seen

    def _why_lost(self, found: Match, seen: Seen) -> str:
        """Return why a match is not believed; empty if it is."""
        if not self._has_surface:
            if self._was_placed and self.map.points >= LEAST_SURFACE:
                return 'hardly any of the map is around the pose that was set'
            return NO_MAP
        usual = self._usual_share  # 0 at first: then least_share alone counts
        if found.share < self._config.least_share:
            return f'{found.share:.0%} of the points near the map lie on it'
        if found.share < LEAST_OF_USUAL * usual:
            return f'{found.share:.0%} of the points near the map lie on it, {usual:.0%} is usual'
        clear = clear_share(seen.points, found.pose, self.map.keyframes_around, found.on)
        if clear < self._config.least_clear:
            return f'{1.0 - clear:.0%} of the points are in space that was seen to be free'
        return self._recovery.doubt(found, clear)

    def _searched(
        self,
        cloud: Cloud,
        seen: Seen,
        guess: Array,
        covariance: Array,
        failed: Match,
        lost: str,
    ) -> tuple[Match, str]:
        """Search for the robot; return the match and why it is still lost."""
        here = Guess(guess, covariance, bool(self._track.jump), self._track.paused)
        if self._recovery.is_beyond(seen, here, failed, self.map.keyframes):
            return Match.none(guess, len(seen.points)), ''
        around = Seen.joined([seen, self._seen_since_lost(cloud)])
        around = around.thinned(self._config.point_spacing)
        found = self._recovery.search(around, here, cloud.odometry, self.map.keyframes)
        if isinstance(found, str):
            return failed, '; '.join(filter(None, [self._track.jump, lost, found]))
        robot = found.pose @ inverse(cloud.mount)
        of_robot = carried(inverted(found.information + FOUND), robot[:3, 3] - found.pose[:3, 3])
        self.place(robot, *cloud.robot, of_robot)
        self._was_placed = False
        return found, ''

    def _seen_since_lost(self, cloud: Cloud) -> Seen:
        """Map anew since the robot was lost; return what is around it, in the cloud's frame.

        A single cloud fits wherever a room looks alike. If it does not fit the new map, odometry
        went wrong meanwhile, or the robot was carried, and that map begins again.
        """
        if self._since_lost is None or (
            (estimate := self._since_lost.add(cloud)).lost not in ('', NO_MAP)
        ):
            self._since_lost = Mapper(replace(self._config, extend_map=True), searches=False)
            estimate = self._since_lost.add(cloud)
        pose = self._since_lost.poses_of([estimate])[0]
        return self._since_lost.map.seen_around().moved(inverse(pose))


def _cost(matched: tuple[Match, Seen]) -> float:
    return matched[0].cost
