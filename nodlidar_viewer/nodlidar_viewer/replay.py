"""A recording, moved to any instant."""

from collections.abc import Sequence

from nodlidar_assembler.clouds.points import Points
from nodlidar_common.stamps import NS_PER_S
from nodlidar_viewer.recent_points import RecentPoints
import numpy as np

SPAN_NS = 10 * NS_PER_S  # before an instant that was jumped to, from which points are shown


class Replay:
    """Holds the points that a page shows at an instant of a recording.

    Parameters
    ----------
    clouds
        In the order of their time, at least one.
    most_points
        That are shown.

    Attributes
    ----------
    recent
        The points at the present instant.
    """

    def __init__(self, clouds: Sequence[Points], most_points: int) -> None:
        self._clouds = clouds
        self._stamps_ns = np.array([cloud.stamp_ns for cloud in clouds])
        self._next = 0  # cloud
        self.recent = RecentPoints(most_points)

    @property
    def duration(self) -> float:
        """Time from the first to the last cloud [s]."""
        return float(self._stamps_ns[-1] - self._stamps_ns[0]) / NS_PER_S

    def move_to(self, seconds: float) -> None:
        """Move to an instant [s] after the first cloud, forward or back."""
        now_ns = int(self._stamps_ns[0]) + round(seconds * NS_PER_S)
        end = int(np.searchsorted(self._stamps_ns, now_ns, side='right'))
        begin = int(np.searchsorted(self._stamps_ns, now_ns - SPAN_NS))
        if end < self._next or begin > self._next:
            self.recent.clear()
            self._next = begin
        for cloud in self._clouds[self._next : end]:
            self.recent.add(cloud.stamp_ns, cloud.xyz.astype(np.float32))
        self._next = end
