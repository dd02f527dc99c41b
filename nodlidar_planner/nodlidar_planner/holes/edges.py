"""The azimuths at which empty squares may begin and end."""

from dataclasses import dataclass
from functools import lru_cache
import math

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.task import Task
import numpy as np


@dataclass(frozen=True, slots=True)
class Edges:
    """Where squares may begin and end: at the steps' lines and at the region's edges.

    Attributes
    ----------
    azimuth
        Of each edge [rad], ascending.
    first_step
        Step of edge 0; for the region's edge, the step before that of edge 1.
    starts
        The first so many edges are left edges to try.
    """

    azimuth: Array
    first_step: int
    starts: int

    def next_wider(self, left: Integers, width: float) -> Integers:
        """Return the first edge, maybe past the last, beyond a width from each left edge, (n,)."""
        return np.searchsorted(self.azimuth, self.azimuth[left] + width, side='right')


@lru_cache(maxsize=4)
def edges_of(task: Task) -> Edges:
    """Return the edges of a task's region.

    Raises
    ------
    ParameterError
        If the region reaches beyond the window and back into it from the other side.
    """
    if task.full_circle:
        step = np.arange(2 * task.steps_per_revolution, dtype=np.float64)
        around = task.azimuth_of_step_0 + step * (math.tau / task.steps_per_revolution)
        return Edges(around, 0, task.steps_per_revolution)
    from_centre, steps = task.from_centre(), np.flatnonzero(task.column_of_step() >= 0)
    steps = steps[np.argsort(from_centre[steps], kind='stable')]
    if (np.diff(steps) % task.steps_per_revolution > 1).any():
        limit = 'so narrow that the region begins or ends within the window of the lidar'
        raise ParameterError('azimuth', limit, task.azimuth)
    lines = np.clip(from_centre[steps], -task.azimuth, task.azimuth)
    azimuth = np.concatenate([[-task.azimuth], lines, [task.azimuth]]) + task.centre
    return Edges(azimuth, int(steps[0]) - 1 if len(steps) else 0, len(azimuth) - 1)
