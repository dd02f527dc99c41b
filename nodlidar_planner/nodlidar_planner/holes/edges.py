"""The azimuths at which empty squares may begin and end."""

from dataclasses import dataclass
from functools import lru_cache
import math

from nodlidar_planner.holes.beam_gaps import Floats, Integers
from nodlidar_planner.pattern.task import AZIMUTH_OF_STEP_0, Task
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

    azimuth: Floats
    first_step: int
    starts: int

    def next_wider(self, left: Integers, width: float) -> Integers:
        """Return the first edge further than a width from each left edge; may be past the last."""
        return np.searchsorted(self.azimuth, self.azimuth[left] + width, side='right')


@lru_cache(maxsize=4)
def edges_of(task: Task) -> Edges:
    """Return the edges of a task's region."""
    if task.full_circle:
        step = np.arange(2 * task.steps_per_revolution, dtype=np.float64)
        around = AZIMUTH_OF_STEP_0 + step * (math.tau / task.steps_per_revolution)
        return Edges(around, 0, task.steps_per_revolution)
    steps = np.flatnonzero(task.column_of_step() >= 0)  # consecutive ones
    lines = np.clip(task.step_azimuth()[steps], -task.azimuth, task.azimuth)
    azimuth = np.concatenate([[-task.azimuth], lines, [task.azimuth]])
    return Edges(azimuth, int(steps[0]) - 1 if len(steps) else 0, len(azimuth) - 1)
