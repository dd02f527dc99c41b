"""Joins the points of scans into clouds of one or more sweeps, cut at the reversals."""

from collections import deque

from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.stamps import NS_PER_S
import numpy as np

# Reversals kept until scans arrive: a minute at 50 per second.
MOST_REVERSALS = 3000
# Scans in one cloud, also if their stamps are equal: half a minute at 100 per second.
MOST_SCANS = 3000
# A nod without a reversal for this many times what it usually takes rests. Usual is the second
# longest of the last clouds: one may be a rest, and every second sweep a fast return. What the
# commanded nod takes is usual, too, from its first sweep on. Shorter ones than _SHORTEST [s] need
# no end.
RESTS, _SHORTEST = 2, 1.5
_CLOUDS = 4


class SweepGatherer:
    """Holds points until the reversal that ends their cloud is known.

    A reversal may be added after the scan in which it happened; it still cuts that scan. The field
    ``ring`` counts the scans of a cloud from 0.

    Parameters
    ----------
    max_duration
        Longest duration of a cloud [s]; at this age, or at RESTS times the usual one, it ends
        without a reversal. While a nod rests, the robot may drive on, and odometry goes astray.
    sweeps
        Sweeps per cloud.

    Attributes
    ----------
    commanded_ns
        How long a sweep of the commanded nod takes [ns]; 0 if that is not known.
    """

    def __init__(self, max_duration: float, sweeps: int = 1) -> None:
        self._max_duration, self._sweeps = max_duration, sweeps
        self.commanded_ns = 0
        self._scans: list[Points] = []
        self._reversals_ns: deque[int] = deque()
        self._ended: list[Points | None] = []
        self._since_cut = 0  # reversals since the last one that ends a cloud
        self._ended_ns: int | None = None  # by the newest reversal that ends a cloud
        self._durations_ns: deque[int] = deque(maxlen=_CLOUDS)

    def add_reversal(self, reversal_ns: int) -> None:
        """Add the instant of a reversal [ns], in ascending order.

        Reversals older than twice the longest cloud are forgotten.
        """
        self._since_cut = (self._since_cut + 1) % self._sweeps
        if self._since_cut == 0:
            if self._ended_ns is not None:
                self._durations_ns.append(reversal_ns - self._ended_ns)
            self._ended_ns = reversal_ns
            self._reversals_ns.append(reversal_ns)
            oldest_ns = reversal_ns - 2 * self._max_duration * NS_PER_S
            while self._reversals_ns[0] < oldest_ns or len(self._reversals_ns) > MOST_REVERSALS:
                self._reversals_ns.popleft()

    def end(self) -> None:
        """End the cloud; `add_scan` returns it with the next scan."""
        if self._scans:
            self._ended.append(joined(self._scans))
        self._scans, self._since_cut = [], 0

    def flush(self) -> list[Points]:
        """Return the clouds that are left when no more scans come, also that of an open sweep."""
        self.end()
        clouds, self._ended = self._ended, []
        return [cloud for cloud in clouds if cloud is not None]

    def restart(self) -> None:
        """End the cloud, and forget the reversals, as when the clock was set."""
        self.end()
        self._ended_ns = None
        self._reversals_ns.clear()

    def add_scan(self, points: Points) -> list[Points]:
        """Add the points of the next scan; return the completed clouds.

        A scan that ends with the last one is left out, as when it arrives twice.
        """
        if not len(points.data):
            return []
        # The first beams of a scan may be stamped before the last ones of the scan before.
        if self._scans and points.time_ns[-1] <= self._newest_ns():
            if points.time_ns[-1] == self._newest_ns():
                return []
            self.restart()  # time went back
        clouds, self._ended = self._ended, []
        if self._scans and self._is_too_long(points):
            clouds.append(self._cut(self._newest_ns() + 1))
        if not self._scans:
            while self._reversals_ns and self._reversals_ns[0] <= points.time_ns[0]:
                self._reversals_ns.popleft()
        self._scans.append(points)
        while self._reversals_ns and self._scans and self._newest_ns() >= self._reversals_ns[0]:
            clouds.append(self._cut(self._reversals_ns.popleft()))
        return [cloud for cloud in clouds if cloud is not None]

    def _newest_ns(self) -> int:
        return int(self._scans[-1].time_ns[-1])

    def _is_too_long(self, points: Points) -> bool:
        duration_ns = int(points.time_ns[-1] - self._scans[0].time_ns[0])
        return duration_ns > self._longest_ns() or len(self._scans) >= MOST_SCANS

    def _longest_ns(self) -> float:
        longest_ns = self._max_duration * NS_PER_S
        if len(self._durations_ns) < 2:
            return longest_ns
        usual_ns = max(sorted(self._durations_ns)[-2], self._sweeps * self.commanded_ns)
        return min(max(RESTS * usual_ns, _SHORTEST * NS_PER_S), longest_ns)

    def _cut(self, end_ns: int) -> Points | None:
        """Remove and return the points before an instant [ns]; None if there are none."""
        before, after = [], []
        for scan in self._scans:
            cut = int(np.searchsorted(scan.time_ns, end_ns, side='left'))
            before.append(scan[:cut])
            after.append(scan[cut:])
        self._scans = [scan for scan in after if len(scan.data)]
        return joined([scan for scan in before if len(scan.data)])


def joined(scans: list[Points]) -> Points | None:
    """Return scans as one cloud in the order of time, with the origin of the first scan.

    Scans may overlap, see `add_scan`. The field ``time`` counts from the first point.
    """
    if not scans:
        return None
    origin = scans[0].origin
    time_ns = np.concatenate([scan.time_ns for scan in scans])
    # Zeros, so that the bytes between fields are always the same.
    data = np.zeros(len(time_ns), dtype=scans[0].data.dtype)
    np.concatenate([scan.data_from(origin) for scan in scans], out=data)
    data['ring'] = np.repeat(np.arange(len(scans)), [len(scan.data) for scan in scans])
    poses = [scan.poses for scan in scans if scan.poses is not None]
    cloud = Points(time_ns, data, origin, Poses.joined(poses) if poses else None)
    if (time_ns[1:] < time_ns[:-1]).any():
        cloud = cloud[np.argsort(time_ns, kind='stable')]
    if 'time' in (data.dtype.names or ()):
        cloud.data['time'] = (cloud.time_ns - cloud.time_ns[0]) / NS_PER_S
    return cloud
