"""The largest hole that a scan pattern leaves after a time, without visiting every sample.

Beams lie on the vertical lines of the steps. A square without beams can slide until its left side
is on one of the edges: a line, or the region's edge. A window lies between two edges. The square
in it is at most as wide as the window and as high as the highest gap between the beams on the
lines strictly within. Wider windows have lower gaps, so bisection finds the best window of each
left edge. A left edge that cannot beat the widest square so far is rejected at its first window.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.errors import ParameterError
from nodlidar_planner.holes.beam_gaps import BeamGaps, WholeBeamGaps
from nodlidar_planner.holes.edges import Edges, edges_of
from nodlidar_planner.holes.late_gaps import LateBeamGaps
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task, wrapped
import numpy as np

Gaps = Callable[[Integers, Integers], tuple[Array, Array]]

# Bounds on time (about 20 s) and memory: array elements to process, in all and for a window.
MAX_WORK = 500_000_000
MAX_WINDOW = 4_000_000
_BLOCK = 1 << 17  # elements processed at once
_PILOTS = 16  # left edges, evenly spread, that first estimate the widest square
_ROUNDING = 1e-12  # [rad]; widths that differ by less count as equal


@dataclass(frozen=True, slots=True)
class Hole:
    """An open square of azimuth and pitch that holds no beam.

    Attributes
    ----------
    side
        Its width and height [rad].
    azimuth, pitch
        Its middle [rad], azimuth in [-pi, pi). In a full circle it may extend across the seam.
    """

    side: float
    azimuth: float
    pitch: float


@dataclass(frozen=True, slots=True)
class _Square:
    """An empty square: its side [rad], the number of its left edge, its lower end [samples]."""

    side: float
    left: int
    bottom: float


_NO_SQUARE = _Square(0.0, 0, 0.0)


def largest_hole(
    task: Task, pattern: Pattern, duration: float, reversals: Array | None = None
) -> Hole:
    """Return the widest open square in a task's region that no beam has hit after some time.

    Exact to rounding (1e-12 rad), also below the nod's finest step, span / N_s. Steps that the
    lidar does not measure have no beams: where the region extends beyond them, there is a hole.
    Without beams, the hole is a square of the region's shorter side. In spite of any number of
    beams, a hole as wide as an azimuth step remains between two lines, if the region holds it.

    Parameters
    ----------
    task
        Region and lidar.
    pattern
        Of the same N_L.
    duration
        Time since sample 0 [s]: samples 0 <= n < duration / T_s are taken. May be infinite, since
        nothing changes after a period of the pattern.
    reversals
        Reversal instants other than the pattern's: see `late_gaps.LateBeamGaps`.

    Raises
    ------
    ParameterError
        If the N_L differ, the duration is negative, or the search would take too long.
    """
    beams = _beams(task, pattern, duration, reversals)
    square = _widest_square(task, beams, duration, _NO_SQUARE, largest_side(task))
    azimuth = float(edges_of(task).azimuth[square.left]) + square.side / 2.0
    bottom = square.bottom * task.span / pattern.samples_per_sweep
    return Hole(
        side=square.side,
        azimuth=wrapped(azimuth),
        pitch=task.pitch_min + bottom + square.side / 2.0,
    )


def exceeds(
    task: Task, pattern: Pattern, duration: float, side: float, reversals: Array | None = None
) -> bool:
    """Return whether the largest hole is wider than a side [rad]; far faster than `largest_hole`.

    Widths that differ by rounding (1e-12 rad) count as equal; see `largest_hole` for the rest.
    """
    beams = _beams(task, pattern, duration, reversals)
    limit = min(largest_side(task), side + 4.0 * _ROUNDING)  # any such square suffices
    return _widest_square(task, beams, duration, _Square(side, 0, 0.0), limit).side > side


def largest_side(task: Task) -> float:
    """Return the side of the hole while there are no beams [rad]."""
    return min(task.span, math.tau if task.full_circle else 2.0 * task.azimuth)


def least_side(task: Task) -> float:
    """Return the side of the hole that always remains between two azimuth steps [rad]."""
    return _widest_without_lines(edges_of(task), largest_side(task)).side


def _beams(task: Task, pattern: Pattern, duration: float, reversals: Array | None) -> BeamGaps:
    if pattern.steps_per_revolution != task.steps_per_revolution:
        limit = f'{task.steps_per_revolution} as in the task'
        raise ParameterError('steps_per_revolution', limit, pattern.steps_per_revolution)
    if reversals is None:
        samples = _samples(task, pattern, duration)
        whole = samples == pattern.period
        return WholeBeamGaps(pattern) if whole else BeamGaps(pattern, samples)
    return LateBeamGaps(pattern, samples_taken(task, duration), reversals)


def _widest_square(
    task: Task, beams: BeamGaps, duration: float, square: _Square, limit: float
) -> _Square:
    """Return the widest square, or any as wide as the limit, or the known one if none is wider."""
    edges, row = edges_of(task), task.span / beams.pattern.samples_per_sweep
    square = max(square, _widest_without_lines(edges, limit), key=lambda each: each.side)
    most = min(MAX_WINDOW, MAX_WORK // edges.starts)
    if square.side < limit:
        if beams.runs > most:
            allowed = f'at most {(most - 1) / task.scan_rate:.6g} s with these N_L and N_s'
            raise ParameterError('duration', allowed, duration)
        square = _widest(edges, beams.between_runs, beams.work_between_runs, row, limit, square)
    finest = min(row * beams.spacing, limit)
    if square.side < finest:
        # Runs are closer together than samples of a run, so no wider square is between runs.
        work = beams.work_between_samples
        if work > most:
            allowed = f'so short that holes of span / N_s = {row:.3g} rad remain'
            raise ParameterError('duration', allowed, duration)
        square = _widest(edges, beams.between_samples, work, row, finest, square)
    return square


def samples_taken(task: Task, duration: float) -> int:
    """Return how many samples are taken in a time [s]."""
    return math.ceil(duration / task.beam_period * (1.0 - 1e-12))  # n T_s has rounding


def _samples(task: Task, pattern: Pattern, duration: float) -> int:
    """Return how many samples are taken in a time, at most a period of them."""
    if not duration >= 0.0:
        raise ParameterError('duration', 'at least 0 s', duration)
    period = pattern.period
    return period if duration >= period * task.beam_period else samples_taken(task, duration)


def _widest_without_lines(edges: Edges, limit: float) -> _Square:
    width = np.diff(edges.azimuth)
    left = int(np.argmax(width[: edges.starts]))
    return _Square(min(float(width[left]), limit), left, 0.0)


def _widest(
    edges: Edges, gaps: Gaps, work: int, row: float, limit: float, square: _Square
) -> _Square:
    """Return the widest square up to a limit, or the known one if none is wider.

    Parameters
    ----------
    gaps, work
        Returns the highest gaps of windows; array elements that it processes for one window.
    row, limit, square
        Height of one sample [rad]; greatest side [rad]; the widest square so far.
    """
    for left in _blocks(edges.starts, max(1, _BLOCK // work)):
        if square.side >= limit - _ROUNDING:
            break
        square = _wider(edges, gaps, row, limit, square, left)
    return square


def _blocks(starts: int, size: int) -> Iterator[Integers]:
    every = np.arange(starts)
    yield every[:: max(1, starts // min(_PILOTS, size))]
    for begin in range(0, starts, size):
        yield every[begin : begin + size]


def _wider(
    edges: Edges, gaps: Gaps, row: float, limit: float, square: _Square, left: Integers
) -> _Square:
    """Return the widest square at some left edges, or the known one if none is wider."""
    low = edges.next_wider(left, square.side + _ROUNDING)
    high = np.minimum(edges.next_wider(left, limit - _ROUNDING), len(edges.azimuth) - 1)
    right = low  # a left edge whose first window has no gap high enough is rejected
    while (open_ := low <= high).any() and square.side < limit - _ROUNDING:
        left, right, low, high = left[open_], right[open_], low[open_], high[open_]
        width = edges.azimuth[right] - edges.azimuth[left]
        gap, bottom = gaps(edges.first_step + left + 1, edges.first_step + right - 1)
        side = np.minimum(width, np.minimum(row * gap, limit))
        best = int(np.argmax(side))
        if side[best] > square.side:
            square = _Square(float(side[best]), int(left[best]), float(bottom[best]))
        low = np.where(side == width, right + 1, low)
        low = np.maximum(low, edges.next_wider(left, square.side + _ROUNDING))
        high = np.where(side == width, high, right - 1)
        right = (low + high) // 2
    return square
