"""The largest hole that a scan pattern leaves after a time, without going through its samples.

Beams lie on the vertical lines of the steps. A square without beams can be slid until its left
edge is on a line or on the region's edge: call these `edges`. From edge to edge there is a window;
the square in it is as wide as the window at most, and as high as the highest gap between the
beams of the lines strictly within. Wider windows have lower gaps, so bisection finds each left
edge's best window; and a left edge that cannot beat the widest square so far needs one look.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import math

from nodlidar_common.errors import ParameterError
from nodlidar_planner.holes.beam_gaps import BeamGaps, Floats, Integers, WholeBeamGaps
from nodlidar_planner.holes.edges import Edges, edges_of
from nodlidar_planner.holes.late_gaps import LateBeamGaps
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np

Gaps = Callable[[Integers, Integers], tuple[Floats, Floats]]

# Bounds on time (about 20 s) and memory: array elements to go through, in all and for a window.
MAX_WORK = 500_000_000
MAX_WINDOW = 4_000_000
_BLOCK = 1 << 17  # elements gone through at once
_PILOTS = 16  # left edges, evenly spread, that first tell about how wide the widest is
_ROUNDING = 1e-12  # [rad]; a square that is wider by less is as wide


@dataclass(frozen=True, slots=True)
class Hole:
    """An open square of azimuth and pitch that holds no beam.

    Attributes
    ----------
    side
        Its width and height [rad].
    azimuth, pitch
        Its middle [rad], azimuth in [-pi, pi). In a full circle it may reach across the back.
    """

    side: float
    azimuth: float
    pitch: float


@dataclass(frozen=True, slots=True)
class _Square:
    """An empty square, from its left edge's number up to a side [rad] and from a height on."""

    side: float
    left: int
    bottom: float


_NO_SQUARE = _Square(0.0, 0, 0.0)


def largest_hole(
    task: Task, pattern: Pattern, duration: float, turns: Floats | None = None
) -> Hole:
    """Return the widest open square in a task's region that no beam has hit after some time.

    Exact but for rounding (1e-12 rad), also below the nod's finest step, span / N_s. Steps that
    the lidar does not measure make no beams: a region wider than what is measured has a hole
    there. While there are no beams, a square of the region's lesser side is the hole; however many
    there are, one as wide as a step of azimuth remains between two lines, if the region holds it.

    Parameters
    ----------
    task
        Region and lidar.
    pattern
        Of the same N_L.
    duration
        Time since sample 0 [s]: samples 0 <= n < duration / T_s were taken. After a period of the
        pattern nothing changes, so infinity is the end.
    turns
        If these are off: see `late_gaps.LateBeamGaps`.

    Raises
    ------
    ParameterError
        If the N_L differ, the duration is negative, or the search would take too long.
    """
    beams = _beams(task, pattern, duration, turns)
    square = _widest_square(task, beams, duration, _NO_SQUARE, largest_side(task))
    azimuth = float(edges_of(task).azimuth[square.left]) + square.side / 2.0
    bottom = square.bottom * task.span / pattern.samples_per_sweep
    return Hole(
        side=square.side,
        azimuth=(azimuth + math.pi) % math.tau - math.pi,
        pitch=task.pitch_min + bottom + square.side / 2.0,
    )


def exceeds(
    task: Task, pattern: Pattern, duration: float, side: float, turns: Floats | None = None
) -> bool:
    """Tell whether the largest hole is wider than a side [rad], in a fraction of its time.

    A side that is less by rounding (1e-12 rad) is as wide; see `largest_hole` for the rest.
    """
    beams = _beams(task, pattern, duration, turns)
    limit = min(largest_side(task), side + 4.0 * _ROUNDING)  # any such square will do
    return _widest_square(task, beams, duration, _Square(side, 0, 0.0), limit).side > side


def largest_side(task: Task) -> float:
    """Return the side of the hole while there are no beams [rad]."""
    return min(task.span, math.tau if task.full_circle else 2.0 * task.azimuth)


def least_side(task: Task) -> float:
    """Return the side of the hole that is between two steps of azimuth for ever [rad]."""
    return _widest_without_lines(edges_of(task), largest_side(task)).side


def _beams(task: Task, pattern: Pattern, duration: float, turns: Floats | None) -> BeamGaps:
    if pattern.steps_per_revolution != task.steps_per_revolution:
        limit = f'{task.steps_per_revolution} as in the task'
        raise ParameterError('steps_per_revolution', limit, pattern.steps_per_revolution)
    if turns is None:
        samples = _samples(task, pattern, duration)
        whole = samples == pattern.period
        return WholeBeamGaps(pattern) if whole else BeamGaps(pattern, samples)
    return LateBeamGaps(pattern, samples_taken(task, duration), turns)


def _widest_square(
    task: Task, beams: BeamGaps, duration: float, square: _Square, limit: float
) -> _Square:
    """Return the widest square, or one of the limit, if it is wider than the one known."""
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
        # All runs in a window are closer than samples; so are these, and no square is wider.
        work = beams.work_between_samples
        if work > most:
            allowed = f'so short that there are holes of span / N_s = {row:.3g} rad'
            raise ParameterError('duration', allowed, duration)
        square = _widest(edges, beams.between_samples, work, row, finest, square)
    return square


def samples_taken(task: Task, duration: float) -> int:
    """Return how many samples are taken in a time [s]."""
    return math.ceil(duration / task.sample_time * (1.0 - 1e-12))  # n T_s has rounding


def _samples(task: Task, pattern: Pattern, duration: float) -> int:
    """Return how many samples are taken in a time, at most a period of them."""
    if not duration >= 0.0:
        raise ParameterError('duration', 'at least 0 s', duration)
    period = pattern.period
    return period if duration >= period * task.sample_time else samples_taken(task, duration)


def _widest_without_lines(edges: Edges, limit: float) -> _Square:
    width = np.diff(edges.azimuth)
    left = int(np.argmax(width[: edges.starts]))
    return _Square(min(float(width[left]), limit), left, 0.0)


def _widest(
    edges: Edges, gaps: Gaps, work: int, row: float, limit: float, square: _Square
) -> _Square:
    """Return the widest square, up to a limit, if it is wider than the one that is known.

    Parameters
    ----------
    gaps, work
        The highest gaps of windows, and the array elements that one window takes.
    row, limit, square
        Height of one sample [rad]; what no square can exceed [rad]; the widest so far.
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
    """Return the widest square from some left edges on, if it is wider than the one known."""
    low = edges.next_wider(left, square.side + _ROUNDING)
    high = np.minimum(edges.next_wider(left, limit - _ROUNDING), len(edges.azimuth) - 1)
    right = low  # the first look: a left edge with no gap high enough there is done with
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
