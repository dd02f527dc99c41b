"""Where empty squares may begin and end in azimuth."""

from dataclasses import dataclass
from functools import lru_cache
import math

from nodlidar_planner.holes.beam_gaps import Floats, Integers
from nodlidar_planner.pattern.task import AZIMUTH_OF_STEP_0, Task
import numpy as np


@dataclass(frozen=True, slots=True)
class Edges:
    """Where squares may begin and end: the lines of the steps and the edges of the region.

    Attributes
    ----------
    azimuth
        Of each edge [rad], ascending.
    first_step
        The step whose line edge 0 is, or would be.
    starts
        How many edges, from the first on, are left edges to try.
    """

    azimuth: Floats
    first_step: int
    starts: int

    def next_wider(self, left: Integers, width: float) -> Integers:
        """Return the first edge further from each left edge than a width; may be past the last."""
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
