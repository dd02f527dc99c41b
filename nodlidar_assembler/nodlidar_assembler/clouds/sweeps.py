"""Gathers the points of scans into one cloud per sweep, or several, cut at the reversal."""

from collections import deque
from dataclasses import dataclass, field

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_common.nod import NS_PER_S
import numpy as np

# Reversals that are kept until scans come: a minute at 50 a second.
MOST_TURNS = 3000
# Scans of one cloud, whatever their stamps: half a minute at 100 a second.
MOST_SCANS = 3000


@dataclass(slots=True)
class SweepGatherer:
    """Holds points until the reversal that ends their last sweep is known.

    Turns and scans may come in any order: a turn that becomes known late still cuts the scan in
    whose middle it was. The field ``ring`` counts the scans of a cloud from 0.

    Attributes
    ----------
    max_duration
        Longest cloud that is waited for [s]; it is closed then even without a turn, so that a
        nod that stands still does not gather points without end.
    sweeps
        How many make one cloud.
    """

    max_duration: float
    sweeps: int = 1
    _scans: list[Points] = field(default_factory=list)
    _turns_ns: deque[int] = field(default_factory=deque)
    _ended: list[Points | None] = field(default_factory=list)
    _turned: int = 0  # turns since the last cloud was cut

    def add_turn(self, turn_ns: int) -> None:
        """Add the instant of a reversal [ns]; they ascend.

        Those that are older than the longest cloud wait for no scan any more.
        """
        self._turned = (self._turned + 1) % self.sweeps
        if self._turned == 0:
            self._turns_ns.append(turn_ns)
            oldest_ns = turn_ns - 2 * self.max_duration * NS_PER_S
            while self._turns_ns[0] < oldest_ns or len(self._turns_ns) > MOST_TURNS:
                self._turns_ns.popleft()

    def end(self) -> None:
        """End the cloud here, as when the clock was set; it is returned with the next scan."""
        if self._scans:
            self._ended.append(_joined(self._scans))
        self._scans, self._turned = [], 0
        self._turns_ns.clear()

    def add_scan(self, points: Points) -> list[Points]:
        """Add the points of the next scan; return the clouds that are complete by now."""
        if not len(points.data):
            return []
        if self._scans and points.time_ns[0] < self._newest_ns():
            # Time went back: what came before it ends here.
            self.end()
        clouds, self._ended = self._ended, []
        if self._scans and self._is_too_long(points):
            clouds.append(self._cut(self._newest_ns() + 1))
        if not self._scans:
            while self._turns_ns and self._turns_ns[0] <= points.time_ns[0]:
                self._turns_ns.popleft()
        self._scans.append(points)
        while self._turns_ns and self._scans and self._newest_ns() >= self._turns_ns[0]:
            clouds.append(self._cut(self._turns_ns.popleft()))
        return [cloud for cloud in clouds if cloud is not None]

    def _newest_ns(self) -> int:
        return int(self._scans[-1].time_ns[-1])

    def _is_too_long(self, points: Points) -> bool:
        duration_ns = int(points.time_ns[-1] - self._scans[0].time_ns[0])
        return duration_ns > self.max_duration * NS_PER_S or len(self._scans) >= MOST_SCANS

    def _cut(self, end_ns: int) -> Points | None:
        """Take everything before an instant out as one cloud; None if there is nothing."""
        before, after = [], []
        for scan in self._scans:
            cut = int(np.searchsorted(scan.time_ns, end_ns, side='left'))
            before.append(Points(scan.time_ns[:cut], scan.data[:cut], scan.origin))
            after.append(Points(scan.time_ns[cut:], scan.data[cut:], scan.origin))
        self._scans = [scan for scan in after if len(scan.data)]
        return _joined([scan for scan in before if len(scan.data)])


def _joined(scans: list[Points]) -> Points | None:
    """Join scans into one cloud whose times count from its first point, in the first's frame."""
    if not scans:
        return None
    origin = scans[0].origin
    time_ns = np.concatenate([scan.time_ns for scan in scans])
    # Zeros, so that the bytes between fields are always the same.
    data = np.zeros(len(time_ns), dtype=scans[0].data.dtype)
    np.concatenate([scan.counted_from(origin).data for scan in scans], out=data)
    if 'time' in (data.dtype.names or ()):
        data['time'] = (time_ns - time_ns[0]) / NS_PER_S
    data['ring'] = np.repeat(np.arange(len(scans)), [len(scan.data) for scan in scans])
    return Points(time_ns, data, origin)
