"""Fig. 4: the pattern of forty scans at N_s = 4007."""

from math import pi
from pathlib import Path

import matplotlib.pyplot as plt
from nodlidar_common.arrays import Array
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from rich.console import Console
from rich.table import Table

from figures.saving import save

N_S, SCANS, SPAN = 4007, 40, pi / 2
# With the stated speed: the span at 10 revolutions per second, or the beam period at span pi/2.
SPAN_OF_SPEED, PERIOD_OF_SPEED = 1.2272, 125e-6


def draw(folder: Path, console: Console) -> Table:
    """Draw the pattern into pattern.png; return the published and our findings."""
    task = Task(pitch_min=-SPAN / 2, pitch_max=SPAN / 2)
    figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.6), width_ratios=(2, 1))
    for shown, mark in zip(axes, (0.4, 5.0), strict=True):
        for going_up, colour in ((True, 'tab:blue'), (False, 'tab:orange')):
            azimuth, pitch = _beams(task, going_up)
            label = 'upward' if going_up else 'downward'
            shown.plot(azimuth, pitch, '.', color=colour, markersize=mark, label=label)
        shown.set(xlabel='azimuth θ [deg]', ylabel='pitch φ [deg]')
    axes[0].set_title(f'N_s = {N_S}, {SCANS} scans, span π/2')
    axes[0].legend(loc='upper right', markerscale=12)
    axes[1].set(xlim=(-6, 6), ylim=(-6, 6), title='a part of it')
    save(figure, folder / 'pattern.png')
    return _findings(task)


def _beams(task: Task, going_up: bool) -> tuple[Array, Array]:
    """Return azimuth and pitch [deg] of the measured samples of one direction of the nod."""
    pattern = Pattern(task.steps_per_revolution, N_S)
    n = np.arange(SCANS * task.steps_per_revolution)
    n = n[(task.column_of_step()[pattern.step(n)] >= 0) & (pattern.going_up(n) == going_up)]
    azimuth = task.step_azimuth()[pattern.step(n)]
    return np.degrees(azimuth), np.degrees(pattern.pitch(n, task.pitch_min, task.pitch_max))


def _findings(task: Task) -> Table:
    table = Table(title=f'Fig. 4: the pattern at N_s = {N_S}, {SCANS} scans')
    table.add_column('published')
    table.add_column('found')
    for phase, name in ((0.0, 'phase 0'), (0.5, 'half a sample')):
        pattern = Pattern(task.steps_per_revolution, N_S, phase)
        n = np.arange(SCANS * task.steps_per_revolution)
        beams = np.stack([pattern.step(n), 2 * pattern.height(n)])
        repeats = len(n) - np.unique(beams, axis=1).shape[1]
        table.add_row(
            'no two samples coincide',
            f'{name}: {repeats} of {len(n)} do; in the period, {pattern.distinct_directions} '
            f'of {pattern.period} are distinct',
        )
    speed = SPAN_OF_SPEED / SPAN * task.speed(N_S)
    slower = SPAN / (N_S * PERIOD_OF_SPEED)
    found = (
        f'{task.speed(N_S):.3f} rad/s at span π/2; {speed:.3f} at {SPAN_OF_SPEED} rad, or '
        f'{slower:.3f} with {PERIOD_OF_SPEED * 1e6:.0f} µs from beam to beam'
    )
    table.add_row('3.136 rad/s at span π/2', found)
    return table
