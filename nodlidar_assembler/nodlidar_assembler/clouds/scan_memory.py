"""The points of the last scans, to be had again as one cloud of any interval."""

from collections import deque
from dataclasses import dataclass

from nodlidar_assembler.clouds.deskew import deskewed
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.sweeps import joined
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.time_order import TIME_JUMP_NS
import numpy as np

# 32 bytes each, 88 if they are to be deskewed.
MOST_POINTS = 4_000_000
# The field `ring` counts the scans of a cloud in 16 bits.
MOST_SCANS = 65_536


@dataclass(frozen=True)
class ScanMemoryConfig:
    """Memory of scans."""

    scan_memory: float = parameter(
        60.0,
        'Time for which points are kept for the service ~/assemble_scans, at most '
        f'{MOST_POINTS // 1_000_000} million points; 0: none, and no service',
        unit='s',
        minimum=0.0,
        maximum=600.0,
    )


class ScanMemory:
    """Keeps the points of the scans of the last seconds.

    Parameters
    ----------
    duration
        How long points are kept [s]; also bounded by MOST_POINTS and MOST_SCANS.
    deskew_to
        To which point's instant deskewed points are moved; see `deskewed`.

    Attributes
    ----------
    forgotten_ns
        The newest instant of which points were forgotten [ns]; -1 if none were.
    in_odometry
        Whether the points are in the frame of odometry, else in nodlidar_base_link.
    """

    def __init__(self, duration: float, deskew_to: str = 'last') -> None:
        self._duration_ns = round(duration * NS_PER_S)
        self._deskew_to = deskew_to
        self._scans: deque[Points] = deque()
        self._points = 0
        self.forgotten_ns = -1
        self.in_odometry = False

    def restart(self) -> None:
        """Forget all, as after the clock was set: other instants count."""
        self._scans.clear()
        self._points, self.forgotten_ns = 0, -1

    def add(self, points: Points, in_odometry: bool = False, jumped: bool = False) -> None:
        """Add the points of a scan.

        Points of another frame, or before odometry has jumped, cannot be in one cloud with later
        ones: they are forgotten. A scan older than the newest is left out, as when it arrives
        twice; if it is older by more than a second, time went back.
        """
        if not len(points.time_ns):
            if jumped:
                self._forget_all()
            return
        if self._scans:
            older_ns = int(self._scans[-1].time_ns[-1] - points.time_ns[-1])
            if older_ns > TIME_JUMP_NS:
                self.restart()
            elif older_ns >= 0:
                return
        if jumped or (self._scans and not self._joins(points, in_odometry)):
            self._forget_all()
        self.in_odometry = in_odometry
        self._scans.append(points)
        self._points += len(points.time_ns)
        oldest_ns = int(points.time_ns[-1]) - self._duration_ns
        while (
            self._scans[0].time_ns[-1] < oldest_ns
            or self._points > MOST_POINTS
            or len(self._scans) > MOST_SCANS
        ):
            self._forget()

    def between(self, begin_ns: int, end_ns: int) -> Points | None:
        """Return the points of an interval as one cloud, as if it were one sweep; None if none.

        Parameters
        ----------
        begin_ns, end_ns
            The first and the last instant [ns]; 0 for the oldest and the newest that is kept.

        Raises
        ------
        ParameterError
            If the interval ends before it begins, or points at its begin were forgotten.
        """
        if end_ns and end_ns < begin_ns:
            raise ParameterError(
                'end', f'at least begin = {_seconds(begin_ns)} s', _seconds(end_ns)
            )
        if 0 < begin_ns <= self.forgotten_ns:
            limit = f'after {_seconds(self.forgotten_ns)} s: older points are not kept'
            raise ParameterError('begin', limit, _seconds(begin_ns))
        cuts = (_cut(scan, begin_ns, end_ns) for scan in self._scans)
        cloud = joined([cut for cut in cuts if len(cut.time_ns)])
        return None if cloud is None else deskewed(cloud, self._deskew_to)

    def _joins(self, points: Points, in_odometry: bool) -> bool:
        last = self._scans[-1]
        return (
            in_odometry == self.in_odometry
            and (points.poses is None) == (last.poses is None)
            and points.data.dtype == last.data.dtype
        )

    def _forget_all(self) -> None:
        while self._scans:
            self._forget()

    def _forget(self) -> None:
        scan = self._scans.popleft()
        self._points -= len(scan.time_ns)
        self.forgotten_ns = int(scan.time_ns[-1])


def _cut(scan: Points, begin_ns: int, end_ns: int) -> Points:
    first = int(np.searchsorted(scan.time_ns, begin_ns, side='left'))
    last = int(np.searchsorted(scan.time_ns, end_ns, side='right')) if end_ns else None
    return scan if first == 0 and last in (None, len(scan.time_ns)) else scan[first:last]


def _seconds(time_ns: int) -> str:
    seconds, rest = divmod(time_ns, NS_PER_S)
    return f'{seconds}.{rest:09d}'
