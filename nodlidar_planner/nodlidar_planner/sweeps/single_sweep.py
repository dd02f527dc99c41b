"""The nod that sees every cell within one sweep: no nod sees them much sooner.

In each revolution the lidar passes a column once, and hits one row there. So no nod sees all cells
in fewer revolutions than there are rows, and a single slow sweep needs hardly more. It does not
depend on the timing of reversals.
"""

import math

from nodlidar_planner.pattern.band import coprime_from
from nodlidar_planner.pattern.nod_speeds import MIN_SPEED, PITCH_ERROR
from nodlidar_planner.pattern.task import Task

# Least advance in a revolution, in cells; a larger error is left to the sweeps after. And the
# largest: a fast servo speeds up for a good part of a revolution.
LEAST_ADVANCE, MOST_ADVANCE = 0.4, 0.85


def single_sweep(task: Task, fewest_samples: int = 1) -> int:
    """Return the N_s, coprime with N_L, whose one sweep hits every cell.

    From one revolution to the next, the nod advances by a cell less PITCH_ERROR, and by
    MOST_ADVANCE at most. If that is slower than MIN_SPEED, it is the N_s of that speed.

    Parameters
    ----------
    task
        Region, cells and lidar.
    fewest_samples
        N_s at the highest speed of the servo.
    """
    row = min(task.cell, task.span)
    share = min(max(1.0 - PITCH_ERROR / row, LEAST_ADVANCE), MOST_ADVANCE)
    samples = math.ceil(task.span / (share * row) * task.steps_per_revolution)
    slowest = math.floor(task.speed(1) / MIN_SPEED)
    samples = max(min(samples, slowest), fewest_samples)
    return coprime_from(samples, task.steps_per_revolution)
