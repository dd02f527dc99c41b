"""How a frame lies in its parent, over time or at all times; times are int nanoseconds."""

from bisect import bisect_left, bisect_right
from typing import NamedTuple

from tf2_ros._rigid import interpolate, Rigid
from tf2_ros.exceptions import ExtrapolationException

_EXTRAPOLATION = 'Lookup would require extrapolation '


class Link(NamedTuple):
    """A frame's pose in its parent."""

    parent: str
    pose: Rigid


class StaticLink:
    """A link that holds at all times."""

    latest_ns = 0

    def __init__(self, link: Link) -> None:
        self.link = link

    def at(self, time_ns: int) -> Link:
        """Return the link."""
        return self.link

    def latest(self) -> Link | None:
        """Return the link."""
        return self.link

    def clear(self) -> None:
        """Keep the link: it holds at all times."""


class LinkHistory:
    """A frame's links over the last `span_ns`, by time.

    Of several links at the same time, the last one set counts, except at the earliest time.
    """

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._times_ns: list[int] = []
        self._links: list[Link] = []

    @property
    def latest_ns(self) -> int:
        """Time of the latest link, 0 if there is none."""
        return self._times_ns[-1] if self._times_ns else 0

    def latest(self) -> Link | None:
        """Return the latest link."""
        return self._links[-1] if self._links else None

    def clear(self) -> None:
        """Forget all links."""
        self._times_ns.clear()
        self._links.clear()

    def insert(self, time_ns: int, link: Link) -> bool:
        """Add a link; return False if it is too old."""
        oldest_ns = self.latest_ns - self._span_ns
        while self._times_ns and self._times_ns[0] < oldest_ns:
            del self._times_ns[0], self._links[0]
        if self._times_ns and time_ns < oldest_ns:
            return False
        index = bisect_right(self._times_ns, time_ns)
        if link not in self._links[bisect_left(self._times_ns, time_ns) : index]:
            self._times_ns.insert(index, time_ns)
            self._links.insert(index, link)
        return True

    def at(self, time_ns: int) -> Link:
        """Return the link at a time, interpolated; raises ExtrapolationException."""
        times, links = self._times_ns, self._links
        if times and time_ns in (0, times[-1]):
            return links[-1]
        if times and time_ns == times[0]:
            return links[0]
        self._check_within(time_ns)
        after = bisect_right(times, time_ns)
        one, two = links[after - 1], links[after]
        if one.parent != two.parent:
            return one
        ratio = (time_ns - times[after - 1]) / (times[after] - times[after - 1])
        return Link(one.parent, interpolate(one.pose, two.pose, ratio))

    def _check_within(self, time_ns: int) -> None:
        times = self._times_ns
        if not times:
            raise ExtrapolationException('Lookup would require data, but the buffer has none')
        asked, first, last = (f'{t * 1e-9:.6f}' for t in (time_ns, times[0], times[-1]))
        if len(times) == 1:
            raise ExtrapolationException(
                f'{_EXTRAPOLATION}at time {asked}, but only time {last} is in the buffer'
            )
        if time_ns > times[-1]:
            raise ExtrapolationException(
                f'{_EXTRAPOLATION}into the future.  Requested time {asked} but the latest data '
                f'is at time {last}'
            )
        if time_ns < times[0]:
            raise ExtrapolationException(
                f'{_EXTRAPOLATION}into the past.  Requested time {asked} but the earliest data '
                f'is at time {first}'
            )
