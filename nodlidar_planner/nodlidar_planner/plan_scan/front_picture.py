"""The picture of a front: a plan's pattern with its hole, and holes against time."""

from collections.abc import Sequence
import math
from pathlib import Path

from matplotlib.axes import Axes
from nodlidar_planner.choice.front import Corner, RUNS
from nodlidar_planner.choice.plan import Plan
from nodlidar_planner.choice.timing_error import hole_under_error
from nodlidar_planner.holes.hole import largest_hole
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.plan_scan.pictures import BAND, figure_with_pattern, SAMPLE, save
import numpy as np

CURVE = 60  # times at which the hole is computed


def write_front_picture(
    path: Path, task: Task, plan: Plan, instant: float, front: Sequence[Corner]
) -> None:
    """Draw a plan's pattern up to an instant [s] with its hole, and the front.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    figure, below = figure_with_pattern(task, plan, instant)
    draw_front(below, task, plan, front)
    save(figure, below, path)


def draw_front(axes: Axes, task: Task, plan: Plan, front: Sequence[Corner]) -> None:
    """Draw the corners of the front, and a plan's largest hole over time."""
    time, hole = ([getattr(each, key) for each in front] for key in ('time', 'hole'))
    pattern = Pattern(task.steps_per_revolution, plan.samples_per_sweep, plan.phase)
    times = np.union1d(np.geomspace(time[0], time[-1], CURVE), time)
    label, error = f'N_s = {plan.samples_per_sweep}', plan.under_error
    if error is None:
        holes = [largest_hole(task, pattern, t).side for t in times]
    else:
        label += f', median under {error.error * 1e3:g} ms of timing error'
        holes = [hole_under_error(task, pattern, t, error.error, RUNS).median for t in times]
    axes.step(times, np.degrees(holes), where='post', color=BAND, label=label)
    axes.plot(time, np.degrees(hole), 'o', color=SAMPLE, label='the front')
    for each in front:
        text = f' {each.samples_per_sweep}'
        axes.annotate(text, (each.time, math.degrees(each.hole)), color=SAMPLE, fontsize=8)
    axes.set(xscale='log', yscale='log', xlabel='time [s]', ylabel='largest hole [°]')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter('{x:g}')
        axis.set_minor_formatter('{x:g}')
    axes.grid(alpha=0.3, which='both')
