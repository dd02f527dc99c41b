"""A completion time that no nod from limit to limit can beat."""

from bisect import bisect_left
import math

from nodlidar_planner.pattern.task import column_runs, Task
import numpy as np


def lower_bound(task: Task, fewest_samples: int) -> float:
    """Return a completion time [s] that no nod from limit to limit can beat.

    A cell is hit anew only where the lidar enters its column or the nod its row; so no more cells
    are hit than columns and rows are entered. The nod enters no more rows than at its highest
    speed, even if speed and turns are chosen at will.

    Parameters
    ----------
    task
        What must be covered.
    fewest_samples
        The N_s of the highest speed.
    """
    column_of_step = task.column_of_step()
    starts, _ = column_runs(column_of_step)
    if len(starts) < task.columns:
        return math.inf
    entries = np.bincount(starts, minlength=len(column_of_step)).cumsum()
    measured = (column_of_step >= 0).cumsum()
    height = max(1.0, task.row_height(fewest_samples))

    def cells_hit(n: int) -> int:
        revolutions, step = divmod(n, len(entries))
        columns = revolutions * entries[-1] + entries[step]
        measuring = revolutions * measured[-1] + measured[step]
        # Two rows may be entered at once more: one at either end of a stretch, at a turn.
        return int(columns + measuring / height) + 2 * (revolutions + 1)

    most = task.rows * task.steps_per_revolution
    return bisect_left(range(most), task.cells, key=cells_hit) * task.sample_time
