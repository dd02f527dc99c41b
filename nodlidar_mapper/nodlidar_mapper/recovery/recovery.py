"""The search for a lost robot: in which area, and when a place is believed."""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_mapper.geometry.poses import between, inverse
from nodlidar_mapper.geometry.seen import Seen
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.graph.loops import LoopConfig
from nodlidar_mapper.recovery.place_search import (
    ALIKE,
    Area,
    best_place,
    clear_share,
    fit_of,
    Place,
)
from nodlidar_mapper.tracking.matching import Match
import numpy as np

UNMAPPED = 0.1  # share of the points near the map, below which the map does not reach there
NEARBY = 1.0, 0.5  # first area searched around odometry [m], [rad]; each failure doubles it
UNNOTICED = 1  # times that it doubles while odometry may be right: it may jump by 2 m unnoticed
FAR_OFF = 3.0  # standard deviations of odometry that are searched, at least
AT_ONCE, EVERY = 6, 3  # this many clouds are searched at once, and then every third one
ANYWHERE = 11  # clouds, after which the whole map is searched
LEAST_FIT = 0.6  # of a place nearby, by the first search
LIKELY_FIT = 0.75  # where odometry expects the robot, to end the search
# The least fit of any other place, by what was seen from one place, and from all around: the more
# of its surroundings the robot has seen, the less do they look like others.
SURE_FIT = 0.95, 0.9
LEAST_CLEAR = 0.85
SAME = 0.3, 0.1  # two searches agree within [m], [rad]


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Where odometry expects a lost robot.

    Attributes
    ----------
    pose, covariance
        Of the cloud's frame in the map; of its change, shape (6, 6).
    jumped
        Whether odometry just jumped.
    paused
        Whether there were no clouds for a long time before.
    """

    pose: Array
    covariance: Array
    jumped: bool
    paused: bool


class Recovery:
    """Searches for a robot that is lost, in a larger area after each failure.

    A place far from odometry counts only if the next search finds the same one. While odometry may
    be right, only the places around it are searched: rooms look alike, and where the map does not
    reach yet, another one would be found.

    Parameters
    ----------
    config
        Of the map.
    anywhere
        Whether the robot may be anywhere in the map from the beginning.
    """

    def __init__(self, config: LoopConfig, anywhere: bool = False) -> None:
        self._config = config
        self._clouds = 0
        self._wrong = ANYWHERE if anywhere else 0  # clouds that odometry does not explain
        self._jumped = self._anywhere = anywhere
        self._suspected: Array | None = None  # frame of odometry in the map

    def forget(self) -> None:
        """Begin anew: the robot is found."""
        self._clouds, self._wrong, self._suspected = 0, 0, None
        self._jumped = self._anywhere = False

    def doubt(self, found: Match, clear: float) -> str:
        """Return why a match where odometry expects it does not end the search, if it does not."""
        if self._anywhere:
            return 'the robot may be anywhere in the map'
        if (self._clouds or self._jumped) and (fit_of(found) < LIKELY_FIT or clear < LEAST_CLEAR):
            return f'{fit_of(found):.0%} of the points lie on the map'
        return ''

    def is_beyond(
        self, seen: Seen, guess: Guess, found: Match, keyframes: Sequence[Keyframe]
    ) -> bool:
        """Return whether the robot went where the map does not reach, while there were no clouds.

        Parameters
        ----------
        seen, guess, keyframes
            See `search`.
        found
            The cloud matched where odometry expects it.
        """
        went_on = guess.paused and not guess.jumped and not self._clouds and not self._jumped
        if not went_on or found.near_share > UNMAPPED:
            return False
        return clear_share(seen.points, guess.pose, keyframes) >= LEAST_CLEAR

    def search(
        self, seen: Seen, guess: Guess, odometry: Array, keyframes: Sequence[Keyframe]
    ) -> Match | str:
        """Return where a cloud was taken, or why that is not known.

        Parameters
        ----------
        seen
            The cloud and what was seen around it since the robot was lost, in the cloud's frame.
        guess
            Pose of the cloud's frame by odometry since the robot was lost.
        odometry
            The same in the frame of odometry.
        keyframes
            Of the map.
        """
        if not len(seen.points):
            return 'the cloud has no usable points'
        self._clouds += 1
        self._jumped |= guess.jumped
        clear = clear_share(seen.points, guess.pose, keyframes)
        explained = not self._jumped and clear >= LEAST_CLEAR
        self._wrong += not explained
        if self._clouds > AT_ONCE and self._clouds % EVERY:
            return 'searched again soon'
        doubled = self._clouds - 1 if explained else self._wrong - 1
        doubled = min(doubled, UNNOTICED if explained else ANYWHERE)
        spread = FAR_OFF * np.sqrt(np.diag(guess.covariance))
        distance = max(NEARBY[0] * 2.0**doubled, float(spread[:3].max()))
        turn = max(NEARBY[1] * 2.0**doubled, float(spread[5]))
        place = best_place(seen, keyframes, Area(guess.pose, distance, turn), self._config)
        nearby = self._clouds == 1 and (distance, turn) == NEARBY
        extent = float(np.linalg.norm(seen.origins, axis=1).max())
        sure = float(np.interp(extent, (0.0, self._config.map_radius / 2.0), SURE_FIT))
        why = _doubt(place, LEAST_FIT if nearby else sure, nearby, self._config.free)
        if place is None or why:
            self._suspected = None
            return why
        if nearby or self._agrees(place.found.pose, odometry):
            return place.found
        return 'a place was found, which the next search must confirm'

    def _agrees(self, pose: Array, odometry: Array) -> bool:
        """Return whether the search before found the same place, by odometry since then."""
        before, self._suspected = self._suspected, pose @ inverse(odometry)
        if before is None:
            return False
        distance, turn = between(before @ odometry, pose)
        return distance < SAME[0] and turn < SAME[1]


def _doubt(place: Place | None, least_fit: float, nearby: bool, free: Sequence[int]) -> str:
    """Return why a place is not certain; empty if it is."""
    if place is None:
        return 'the map is empty here'
    if place.fit < least_fit:
        return (
            f'{place.fit:.0%} of the points lie on the map at the best place, {least_fit:.0%} must'
        )
    if place.clear < LEAST_CLEAR:
        return 'at the best place, walls would stand in free space'
    if place.found.shown(free) < len(free) - 1:  # one direction less along a corridor
        return 'the best place shows too little, as a bare floor'
    if not nearby and place.rival > ALIKE * place.fit:
        return 'two places fit alike'
    return ''
