"""A robot that is lost: what shows it, and how it is found again."""

from collections.abc import Sequence

from nodlidar_mapper.keyframe import Keyframe
from nodlidar_mapper.matching import Match, MatchingConfig
from nodlidar_mapper.place_search import ALIKE, Area, best_place, fit_of, Place
from nodlidar_mapper.poses import Array, between, inverse
from nodlidar_mapper.seen import Seen

NEARBY = 1.0, 0.5  # first area searched around odometry [m], [rad]; each failure doubles it
EVERY = 3  # clouds, once a large area was searched
ANYWHERE = 11  # clouds, after which the whole map is searched
# What a place must reach nearby, and anywhere: alike places may be anywhere.
LEAST_FIT, LIKELY_FIT, SURE_FIT = 0.6, 0.75, 0.85
LEAST_CLEAR = 0.85
SAME = 0.3, 0.1  # two searches agree within [m], [rad]


class Recovery:
    """Searches for a robot that is lost, in a larger area after each failure.

    A place far from odometry counts only if the next search finds the same one.

    Parameters
    ----------
    config
        Of the matching.
    anywhere
        Whether the robot may be anywhere in the map from the beginning.
    """

    def __init__(self, config: MatchingConfig, anywhere: bool = False) -> None:
        self._config = config
        self._clouds = ANYWHERE if anywhere else 0
        self._suspected: Array | None = None  # frame of odometry in the map

    def forget(self) -> None:
        """Begin anew: the robot is found."""
        self._clouds, self._suspected = 0, None

    def doubt(self, found: Match, clear: float) -> str:
        """Return why a match where odometry expects it does not end the search; else forget it."""
        if self._clouds and (fit_of(found) < LIKELY_FIT or clear < LEAST_CLEAR):
            return f'{fit_of(found):.0%} of the points lie on the map'
        self.forget()
        return ''

    def search(
        self, seen: Seen, guess: Array, odometry: Array, keyframes: Sequence[Keyframe]
    ) -> Match | str:
        """Return where a cloud was taken, or why that is not known.

        Parameters
        ----------
        seen
            The cloud, in its frame.
        guess
            Pose of the cloud's frame by odometry since the robot was lost.
        odometry
            The same in the frame of odometry.
        keyframes
            Of the map.
        """
        self._clouds += 1
        distance, turn = (reach * 2.0 ** min(self._clouds - 1, ANYWHERE) for reach in NEARBY)
        if self._clouds > 6 and self._clouds % EVERY:
            return 'searched again soon'
        place = best_place(seen, keyframes, Area(guess, distance, turn), self._config)
        nearby = self._clouds == 1
        why = _doubt(place, nearby)
        if place is None or why:
            return why
        if nearby or self._agrees(place.found.pose @ inverse(odometry)):
            return place.found
        return 'a place was found, which the next search must confirm'

    def _agrees(self, map_from_odometry: Array) -> bool:
        before, self._suspected = self._suspected, map_from_odometry
        if before is None:
            return False
        distance, turn = between(before, map_from_odometry)
        return distance < SAME[0] and turn < SAME[1]


def _doubt(place: Place | None, nearby: bool) -> str:
    """Return why a place is not certain; empty if it is."""
    if place is None:
        return 'the map is empty here'
    if place.fit < (LEAST_FIT if nearby else SURE_FIT):
        return f'{place.fit:.0%} of the points lie on the map at the best place'
    if place.clear < LEAST_CLEAR:
        return 'at the best place, walls would stand in free space'
    if not nearby and place.rival > ALIKE * place.fit:
        return 'two places fit alike'
    return ''
