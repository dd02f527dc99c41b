"""The Pareto front of time against hole size over the nods of a band.

A nod's largest hole only shrinks with time. At a corner of the front, no nod of the band has a
smaller hole, and none had as small a hole before. Most nods are rejected at the first few windows
(`hole.exceeds`), so few are searched.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
import math

from nodlidar_common.arrays import Integers
from nodlidar_common.errors import ParameterError
from nodlidar_common.rounding import rounded_down, rounded_up
from nodlidar_planner.choice.plan import Progress
from nodlidar_planner.choice.search import spread
from nodlidar_planner.choice.timing_error import hole_under_error, late_reversals
from nodlidar_planner.holes.hole import (
    exceeds,
    largest_hole,
    largest_side,
    least_side,
    samples_taken,
)
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import Task

# Longest time of a corner [s].
PATIENCE = 600.0
# Seeds of the runs with a timing error; an odd number, for the median.
RUNS = range(15)
# The soonest of this many nods bounds the time of the soonest of all.
FEW = 8
# A corner is shown among others at this many times before and after it, spaced by this factor.
OTHERS, FACTOR = 4, math.sqrt(2.0)
# Holes that differ by less count as equal [rad]: phases are rounded to 1e-8 of a sample, which may
# be 3 rad high.
_ROUNDING = 4e-8


@dataclass(frozen=True, slots=True)
class Corner:
    """A nod at an instant when no other has a smaller hole, and none had as small a one before.

    Attributes
    ----------
    samples_per_sweep
        N_s.
    time
        When its largest hole is this small for the first time [s].
    hole
        Side of the hole [rad].
    """

    samples_per_sweep: int
    time: float
    hole: float


class Front:
    """Finds corners of the front over some nods.

    Parameters
    ----------
    task
        Region and lidar.
    samples
        The N_s to choose from, shape (n,).
    start_pitch
        Pitch at sample 0 [rad], going up; by default half a sample past the lower limit.
    timing_error
        Standard deviation of the reversal instants [s]. Unless it is 0, a nod's hole is the median
        over simulated runs.
    progress
        Wraps each iteration over the nods, to show progress.
    """

    def __init__(
        self,
        task: Task,
        samples: Integers,
        start_pitch: float | None = None,
        timing_error: float = 0.0,
        progress: Progress = iter,
    ) -> None:
        self._task = task
        self._error = timing_error
        self._progress = progress
        # In this order the first ones are spread over the band.
        self._patterns = [
            pattern_from(task, int(samples[i]), start_pitch) for i in spread(len(samples))
        ]

    def choose(self, time_budget: float | None, max_hole: float | None) -> Corner:
        """Return the corner for one limit, or the soonest corner that satisfies both.

        Parameters
        ----------
        time_budget, max_hole
            See `within` and `reaching`; at least one is not None.

        Raises
        ------
        ParameterError
            If no corner satisfies both, naming the corners that satisfy one; and as `reaching` and
            `within`.
        """
        if max_hole is None:
            return self.within(math.nan if time_budget is None else time_budget)
        soonest = self.reaching(max_hole)
        if time_budget is None or soonest.time <= time_budget + self._task.beam_period:
            return soonest
        smallest = self.within(time_budget)
        allowed = (
            f'at least {rounded_up(math.degrees(smallest.hole))}° after {time_budget:g} s '
            f'(N_s = {smallest.samples_per_sweep}), or the time at least '
            f'{rounded_up(soonest.time)} s (N_s = {soonest.samples_per_sweep})'
        )
        raise ParameterError('max_hole', allowed, _degrees(max_hole))

    def around(self, corner: Corner) -> list[Corner]:
        """Return a corner and others from a quarter to four times its time, soonest first."""
        times = [corner.time * FACTOR**k for k in range(-OTHERS, OTHERS + 1) if k]
        others = self.corners([time for time in times if time <= PATIENCE])
        by_time = {each.time: each for each in [*others, corner]}
        return [by_time[time] for time in sorted(by_time)]

    def within(self, time_budget: float) -> Corner:
        """Return the corner with the smallest hole after a time [s].

        Raises
        ------
        ParameterError
            If the time is above PATIENCE, or too short for any nod to divide the region.
        """
        if not 0.0 < time_budget <= PATIENCE:
            allowed = f'above 0 and at most {PATIENCE:g} s'
            raise ParameterError('time_budget', allowed, time_budget)
        corner = self._within(time_budget)
        if corner is None:
            allowed = 'so long that the beams of some nod divide the region'
            raise ParameterError('time_budget', allowed, time_budget)
        return corner

    def reaching(self, max_hole: float) -> Corner:
        """Return the soonest corner without a hole wider than a side [rad].

        Raises
        ------
        ParameterError
            If no nod reaches that within PATIENCE, or if it needs no beam.
        """
        least, largest = least_side(self._task), largest_side(self._task)
        if not least - _ROUNDING < max_hole < largest - _ROUNDING:
            allowed = (
                f'at least {rounded_up(math.degrees(least))}°, which always remains between two '
                f'steps, and below {rounded_down(math.degrees(largest))}°, the size of the region'
            )
            raise ParameterError('max_hole', allowed, _degrees(max_hole))
        soonest = self._soonest(max_hole, self._enough(max_hole))
        if soonest is None:
            allowed = f'so large that some nod reaches it within {PATIENCE:g} s'
            raise ParameterError('max_hole', allowed, _degrees(max_hole))
        smallest = self._smallest(max_hole + _ROUNDING, soonest[0])
        pattern = soonest[1] if smallest is None else smallest[1]
        return self._corner(soonest[0], pattern)

    def corners(self, times: Sequence[float]) -> list[Corner]:
        """Return the corners with the smallest hole after some times [s], soonest first.

        A corner that is best at several times is returned once, times without one are skipped.
        """
        found: list[Corner] = []
        for time in sorted(times, reverse=True):
            if not found or time < found[-1].time:
                corner = self._within(time)
                found += [corner] if corner else []
        return found[::-1]

    def _within(self, time: float) -> Corner | None:
        taken = samples_taken(self._task, time)
        smallest = self._smallest(largest_side(self._task), taken)
        if smallest is None:
            return None
        hole, pattern = smallest
        return self._corner(*(self._soonest(hole + _ROUNDING, taken) or (taken, pattern)))

    def _corner(self, taken: int, pattern: Pattern) -> Corner:
        time = taken * self._task.beam_period
        return Corner(pattern.samples_per_sweep, time, self._hole(pattern, taken))

    def _smallest(self, below: float, taken: int) -> tuple[float, Pattern] | None:
        """Return the smallest hole after some samples and its nod, if it is below a side [rad]."""
        best = None
        for pattern in self._progress(self._patterns):
            if self._is_at(pattern, below - _ROUNDING, taken):
                below = self._hole(pattern, taken)
                best = below, pattern
        return best

    def _soonest(self, side: float, most: int) -> tuple[int, Pattern] | None:
        """Return the fewest samples, up to a limit, until a nod is at a side, and the nod."""
        best = None
        for pattern in self._progress(self._patterns):
            if self._is_at(pattern, side, most):
                taken = bisect_left(range(most), True, key=lambda n: self._is_at(pattern, side, n))
                best = taken, pattern
                most = taken - 1
        return best

    def _enough(self, side: float) -> int:
        """Return a number of samples, doubled until it suffices for one of a few nods."""
        enough, most = self._task.steps_per_revolution, samples_taken(self._task, PATIENCE)
        few = self._patterns[:FEW]
        while enough < most and not any(self._is_at(each, side, enough) for each in few):
            enough *= 2
        return min(enough, most)

    def _hole(self, pattern: Pattern, taken: int) -> float:
        time = taken * self._task.beam_period
        if self._error > 0.0:
            return hole_under_error(self._task, pattern, time, self._error, RUNS).median
        return largest_hole(self._task, pattern, time).side

    def _is_at(self, pattern: Pattern, side: float, taken: int) -> bool:
        """Return whether the hole (with a timing error, of most runs) is at most a side wide."""
        task, time = self._task, taken * self._task.beam_period
        if self._error == 0.0:
            return not exceeds(task, pattern, time, side)
        most, wider = len(RUNS) // 2 + 1, 0
        for runs, seed in enumerate(RUNS, start=1):
            reversals = late_reversals(task, pattern, time, self._error, seed)
            wider += exceeds(task, pattern, time, side, reversals)
            if max(wider, runs - wider) == most:
                break
        return wider < most


def _degrees(angle: float) -> float:
    """Return an angle [rad] in degrees, without the rounding of the conversion."""
    return float(f'{math.degrees(angle):.10g}')
