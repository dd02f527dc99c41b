"""The lower bound of the completion time of any nod from limit to limit."""

from bisect import bisect_left
import math

from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np


def lower_bound(task: Task, fewest_samples: int) -> float:
    """Return a completion time [s] that no nod from limit to limit can beat.

    A new crossing of a cell starts only where the lidar enters its column or the nod its row, so
    no more cells are hit than columns and rows are entered. At any speeds and reversals, the nod
    enters no more rows than at its highest speed.

    Parameters
    ----------
    task
        Region, cells and lidar.
    fewest_samples
        The N_s of the highest speed.
    """
    column_of_step = task.column_of_step()
    starts, _ = column_runs(column_of_step)
    if len(starts) < task.columns:
        return math.inf
    entries = np.bincount(np.maximum(starts, 0), minlength=len(column_of_step)).cumsum()
    measured = (column_of_step >= 0).cumsum()
    height = max(1.0, task.row_height(fewest_samples))

    def cells_hit(n: int) -> int:
        revolutions, step = divmod(n, len(entries))
        columns = revolutions * entries[-1] + entries[step]
        measuring = revolutions * measured[-1] + measured[step]
        # Each measured stretch may enter two more rows: one at either end, at a reversal.
        return int(columns + measuring / height) + 2 * (revolutions + 1)

    most = task.rows * task.steps_per_revolution
    return bisect_left(range(most), task.cells, key=cells_hit) * task.beam_period
