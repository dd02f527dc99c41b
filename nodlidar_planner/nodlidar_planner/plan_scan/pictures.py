"""Pictures of a plan: its pattern with the cells not hit yet, and completion over N_s."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import ScalarFormatter
from nodlidar_common.arrays import Array, Integers
from nodlidar_common.whole_file import whole_file
from nodlidar_planner.choice.plan import Plan
from nodlidar_planner.choice.timing_error import UnderError
from nodlidar_planner.holes.hole import Hole, largest_hole
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np

# More could not be distinguished in the picture.
MAX_SAMPLES, MAX_CELLS = 100_000, 4_000_000
UNCOVERED, SAMPLE, BAND, BOUND = '#f4a261', '#1d3557', '#2a9d8f', '#c1121f'
NOMINAL = '#e76f51'


@dataclass(frozen=True, slots=True)
class Candidates:
    """The candidates and their completion times [s], shapes (n,).

    `under_error` has the completion under a timing error of some of them.
    """

    samples_per_sweep: Integers
    completion_time: Array
    under_error: Sequence[tuple[int, UnderError]] = ()


def write_picture(
    path: Path,
    task: Task,
    plans: Sequence[Plan],
    candidates: Candidates,
    nominal: Plan | None = None,
) -> None:
    """Draw the pattern of the best plan at half its completion time, and all candidates.

    See `mark_plans` for the nominal plan.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    best = plans[0]
    figure, below = figure_with_pattern(task, best, best.figures.completion_time / 2.0)
    draw_completion(below, candidates, best.lower_bound)
    mark_plans(below, plans, nominal)
    save(figure, below, path)


def draw_pattern(axes: Axes, task: Task, pattern: Pattern, instant: float) -> None:
    """Draw the samples up to an instant [s], and fill the cells that none of them hit.

    No cells are filled if there are more than MAX_CELLS.
    """
    count = max(1, round(instant / task.beam_period))
    column = task.column_of_step()[pattern.step(np.arange(count))]
    n = np.flatnonzero(column >= 0)
    column = column[n]
    row = task.row_of_height(pattern.height(n), pattern.samples_per_sweep)
    azimuth = _unwrapped(task)[pattern.step(n)]
    pitch = pattern.pitch(n, task.pitch_min, task.pitch_max)
    if task.cells <= MAX_CELLS:
        _fill_uncovered(axes, task, column, row)
    size = float(np.clip(30_000 / count, 0.3, 9.0))
    axes.scatter(azimuth, pitch, s=size, c=SAMPLE, linewidths=0, rasterized=True)
    axes.set(title=_pattern_title(task, pattern, count, len(np.unique(column * task.rows + row))))
    axes.set(xlabel='azimuth θ [rad]', ylabel='pitch φ [rad]')
    left, right = _region(task)
    axes.set(xlim=(left, right), ylim=(task.pitch_min, task.pitch_max), aspect='equal')


def outline_hole(axes: Axes, task: Task, hole: Hole) -> None:
    """Outline a hole in a drawn pattern; at both ends if it crosses the seam of a full circle."""
    left, right = _region(task)
    begin = left + (hole.azimuth - hole.side / 2.0 - left) % math.tau
    for x in (begin, begin - math.tau):
        if x < right and x + hole.side > left:
            corner = (x, hole.pitch - hole.side / 2.0)
            square = Rectangle(
                corner, hole.side, hole.side, fill=False, color=BOUND, linewidth=1.5
            )
            axes.add_patch(square)


def draw_completion(axes: Axes, candidates: Candidates, lower_bound: float) -> None:
    """Draw completion over N_s; candidates that never complete are ticks at the upper edge."""
    n_s, time = candidates.samples_per_sweep, candidates.completion_time
    complete = np.isfinite(time)
    dots: dict[str, Any] = {'color': SAMPLE, 'markersize': 2, 'rasterized': True}
    axes.plot(n_s[complete], time[complete], '.', label='candidates', **dots)
    if not complete.all():
        ticks: dict[str, Any] = {'color': BOUND, 'transform': axes.get_xaxis_transform()}
        never = n_s[~complete]
        axes.plot(never, np.full(len(never), 0.985), '|', label='never complete', **ticks)
    bars = [(n, e) for n, e in candidates.under_error if math.isfinite(e.p90)]
    if bars:
        low, high = ([getattr(error, key) for _, error in bars] for key in ('median', 'p90'))
        label = 'with timing error: median to 90 %'
        axes.vlines([n for n, _ in bars], low, high, color=BAND, alpha=0.6, label=label)
    if math.isfinite(lower_bound):
        label = f'lower bound {lower_bound:.3g} s'
        axes.axhline(lower_bound, color=BOUND, linestyle='--', label=label)
    axes.set(yscale='log', xlabel='samples per sweep N_s', ylabel='every cell hit once after [s]')
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.grid(alpha=0.3, which='both')


def mark_plans(axes: Axes, plans: Sequence[Plan], nominal: Plan | None = None) -> None:
    """Mark the best plan and, with a timing error, the completion of all plans under it.

    `nominal` is the plan that is best without the error.
    """
    best = plans[0]
    if best.under_error is not None:
        error = f'{best.under_error.error * 1e3:g} ms of timing error'
        _draw_bands(axes, plans, BAND, f'the best with {error}')
    if nominal is not None:
        _draw_bands(
            axes,
            [nominal],
            NOMINAL,
            f'N_s = {nominal.samples_per_sweep}, best without',
        )
    n_s, time = best.samples_per_sweep, best.figures.completion_time
    if math.isfinite(time):
        star: dict[str, Any] = {'color': BAND, 'markeredgecolor': 'black', 'markersize': 14}
        axes.plot(n_s, time, '*', label=f'N_s = {n_s}: {time:.4g} s', **star)
    else:
        axes.axvline(n_s, color=BAND, label=f'N_s = {n_s}: never')


def figure_with_pattern(task: Task, plan: Plan, instant: float) -> tuple[Figure, Axes]:
    """Return a figure with a plan's pattern up to an instant [s], and its lower axes."""
    pattern = Pattern(task.steps_per_revolution, plan.samples_per_sweep, plan.phase)
    figure = Figure(figsize=(12, 9), layout='constrained')
    above, below = figure.subplots(2, 1)
    shown = _shown(task, pattern, instant)
    draw_pattern(above, task, pattern, shown)
    outline_hole(above, task, largest_hole(task, pattern, shown))
    return figure, below


def save(figure: Figure, below: Axes, path: Path) -> None:
    """Write a figure with the legend of its lower axes; raises OSError."""
    below.legend(loc='lower left', bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    with whole_file(path) as part:
        figure.savefig(part, dpi=130)


def _draw_bands(axes: Axes, plans: Sequence[Plan], colour: str, label: str) -> None:
    """Draw a line from median to 90th percentile for each plan that completes under the error."""
    for plan in plans:
        error = plan.under_error
        if error is not None and math.isfinite(error.p90):
            x, y = [plan.samples_per_sweep] * 2, [error.median, error.p90]
            axes.plot(x, y, color=colour, linewidth=2.5, solid_capstyle='butt', label=label)
            label = '_'  # once in the legend


def _shown(task: Task, pattern: Pattern, instant: float) -> float:
    """Return an instant [s], limited to MAX_SAMPLES and to one period of the pattern."""
    samples = min(instant / task.beam_period, MAX_SAMPLES, pattern.period)
    return max(1, math.ceil(samples)) * task.beam_period


def _region(task: Task) -> tuple[float, float]:
    """Return the azimuths at which the region begins and ends [rad]."""
    if task.full_circle:
        return task.azimuth_of_step_0, task.azimuth_of_step_0 + math.tau
    return task.centre - task.azimuth, task.centre + task.azimuth


def _unwrapped(task: Task) -> Array:
    """Return the azimuth of each step [rad], continuous within the region, shape (N_L,)."""
    return task.step_azimuth() if task.full_circle else task.centre + task.from_centre()


def _fill_uncovered(axes: Axes, task: Task, column: Integers, row: Integers) -> None:
    uncovered = np.ones((task.rows, task.columns), dtype=np.float32)
    uncovered[row, column] = np.nan
    left, _ = _region(task)
    right, top = left + task.columns * task.cell, task.pitch_min + task.rows * task.cell
    axes.imshow(
        uncovered,
        extent=(left, right, task.pitch_min, top),
        origin='lower',
        interpolation='nearest',
        cmap=ListedColormap([UNCOVERED]),
    )


def _pattern_title(task: Task, pattern: Pattern, count: int, covered: int) -> str:
    after = f'N_s = {pattern.samples_per_sweep} after {count * task.beam_period:.3g} s'
    left = task.cells - covered
    return f'{after}: {left} of {task.cells} cells not hit yet'
