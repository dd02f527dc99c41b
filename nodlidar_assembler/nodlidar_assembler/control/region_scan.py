"""A region being scanned: what was seen of it so far, and when that ends."""

from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.scan_memory import ScanMemory
from nodlidar_assembler.control.observed_coverage import Covered, ObservedCoverage
from nodlidar_assembler.control.region_plan import LONGEST, RegionPlan
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.time_order import TIME_JUMP_NS
import numpy as np
from numpy.typing import NDArray

# The time limit unless one is given: this many predicted times, but at least this long [s].
PATIENCE, LEAST_LIMIT = 3.0, 5.0
# Time without a scan that was placed, from which on it is named at the time limit, and ends the
# region [s]. Scans wait for joint states, and for odometry.
LATE, SILENT = 2.0, 10.0
# Cells of the finest grid, in which repeats are counted: four bytes each. It has fewer rows for
# that than the nod has samples.
MOST_FINEST = 2**23


@dataclass(frozen=True, slots=True)
class RegionProgress:
    """Share of the cells seen, side of the largest hole [rad], and predicted time to go [s]."""

    seen: float
    largest_hole: float
    time_to_go: float


class RegionScan:
    """Gathers the beams and points of a region until every cell was hit.

    Parameters
    ----------
    plan
        The region and its nod.
    start_ns, begin_ns
        The present time, and when the nod of the plan begins [ns].
    deskew_to
        See ScanMemory.

    Attributes
    ----------
    predicted_time, time_limit
        Time from the start on until all is seen, as predicted, and until it ends at last [s].
    is_over, message
        Whether it has ended, and why, in words.
    """

    def __init__(
        self, plan: RegionPlan, start_ns: int, begin_ns: int, deskew_to: str = 'last'
    ) -> None:
        self._task, self._start_ns, self._last_ns = plan.task, start_ns, start_ns
        self._sweep = plan.sweep
        self._runs = plan.runs + (begin_ns - start_ns) / NS_PER_S
        self.predicted_time = float(np.quantile(self._runs, 0.5, method='higher'))
        usual = min(max(PATIENCE * self.predicted_time, LEAST_LIMIT), LONGEST)
        self.time_limit = plan.time_limit or usual
        rows = min(plan.shape.samples_per_sweep, MOST_FINEST // plan.task.steps_per_revolution)
        self._coverage = ObservedCoverage(plan.task, rows, 2.0 * LONGEST)
        self._memory = ScanMemory(2.0 * LONGEST, deskew_to)
        self._columns = plan.task.column_of_step()
        self.is_over, self.message = False, ''

    @property
    def success(self) -> bool:
        """Whether every cell was seen."""
        return self._coverage.seen == 1.0

    @property
    def cell(self) -> float:
        """Side of a cell [rad]."""
        return self._task.cell

    @property
    def duration(self) -> float:
        """Time from the start to the end, or to the last beam, in the region or not [s]."""
        return (self._last_ns - self._start_ns) / NS_PER_S

    @property
    def covered(self) -> Covered:
        """The coverage of the region since the start."""
        return self._coverage.covered()

    @property
    def points(self) -> Points | None:
        """The points in the region since the start, as one cloud; None if there are none."""
        return self._memory.between(0, 0)

    @property
    def in_odometry(self) -> bool:
        """Whether they are in the frame of odometry."""
        return self._memory.in_odometry

    def add(self, assembled: Assembled) -> None:
        """Add a scan; it may be the last one that is needed."""
        scan, beams = assembled.scan, assembled.beams
        times_ns = scan.stamp_ns + beams.offset_ns
        # A scan that comes twice, or is late, shows nothing new.
        if self.is_over or times_ns[-1] <= self._last_ns:
            return
        since = int(np.searchsorted(times_ns, self._start_ns))
        ordered = np.maximum(times_ns, self._last_ns)[since:]
        self._coverage.add(ordered, beams.azimuth[since:], assembled.pitch[since:])
        self._last_ns = int(times_ns[-1])
        inside = self._inside(assembled)
        self._memory.add(assembled.points[inside], assembled.in_odometry, assembled.jumped)
        if self.success:
            self.end(f'all of it was seen, in {self.duration:.1f} s', self._last_ns)

    def _inside(self, assembled: Assembled) -> NDArray[np.intp]:
        """Return the indices of the points in the region since the start."""
        beams, task = assembled.placed.indices, self._task
        column = self._columns[task.step_at(assembled.beams.azimuth[beams])]
        pitch = assembled.pitch[beams]
        inside = (column >= 0) & (pitch >= task.pitch_min) & (pitch <= task.pitch_max)
        inside &= assembled.scan.stamp_ns + assembled.beams.offset_ns[beams] >= self._start_ns
        return np.flatnonzero(inside)

    def check(self, now_ns: int) -> None:
        """End it at an instant [ns] if its time is over, no scan comes, or time went back."""
        if self._start_ns - now_ns > TIME_JUMP_NS:
            self.end('the clock was set', now_ns)
        silent = (now_ns - self._last_ns) / NS_PER_S
        why = f'no scan of the last {silent:.1f} s was placed'
        if silent > SILENT:
            self.end(why, now_ns)
        if self._elapsed(now_ns) > self.time_limit:
            seen = f'{self._coverage.seen:.1%} was seen'
            over = f'{seen} when the time limit of {self.time_limit:.1f} s was over'
            self.end(f'{over}; {why}' if silent > LATE else over, now_ns)

    def end(self, message: str, now_ns: int) -> None:
        """End it for a reason at an instant [ns], unless it is over."""
        if self.is_over:
            return
        self.is_over, self.message = True, message
        self._last_ns = max(self._last_ns, now_ns)
        lost = (self._memory.forgotten_ns - self._start_ns) / NS_PER_S
        if lost >= 0.0:
            self.message += f'; the cloud lacks the points of the first {lost:.1f} s'

    def progress(self, now_ns: int) -> RegionProgress:
        """Return the progress at an instant [ns].

        The time to go is the median of the simulated runs that take longer than until now. If none
        does, it is until the end of the sweep after, in which what was missed is passed again.
        """
        covered, elapsed = self.covered, self._elapsed(now_ns)
        longer, end = self._runs[self._runs > elapsed], float(self._runs[-1])
        if len(longer):
            end = float(np.quantile(longer, 0.5, method='higher'))
        else:
            end += math.ceil((elapsed - end) / self._sweep) * self._sweep
        to_go = min(end, self.time_limit) - elapsed
        return RegionProgress(covered.seen, covered.hole, max(to_go, 0.0))

    def _elapsed(self, now_ns: int) -> float:
        return (now_ns - self._start_ns) / NS_PER_S
