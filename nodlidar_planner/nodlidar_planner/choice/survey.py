"""What every N_s of a band gives, as pictures show it."""

from collections.abc import Callable, Iterable

from nodlidar_planner.choice.timing_error import under_error, UnderError
from nodlidar_planner.coverage.coverage import Coverage, Figures
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import Task
import numpy as np
from numpy.typing import NDArray

Progress = Callable[[Iterable[int]], Iterable[int]]

# Enough to show how a whole band fares.
SURVEY_RUNS = range(2000, 2016)


def survey(
    task: Task,
    samples: NDArray[np.int64],
    start_pitch: float | None = None,
    progress: Progress = iter,
) -> list[Figures]:
    """Return the figures of each N_s.

    Parameters
    ----------
    task
        What must be covered.
    samples
        N_s, shape (n,).
    start_pitch
        Pitch at sample 0 [rad], going up; half a sample past the lower limit if not given.
    progress
        Wraps the N_s while they are gone through, to show it.
    """
    patterns = (pattern_from(task, n_s, start_pitch) for n_s in progress(samples.tolist()))
    return [Coverage(task, pattern).figures() for pattern in patterns]


def survey_under_error(
    task: Task,
    samples: NDArray[np.int64],
    timing_error: float,
    start_pitch: float | None = None,
    progress: Progress = iter,
) -> list[UnderError]:
    """Return what a few simulated runs of each N_s take; see `survey` and `plans`."""
    found = []
    for n_s in progress(samples.tolist()):
        pattern = pattern_from(task, n_s, start_pitch)
        found.append(under_error(task, pattern, timing_error, SURVEY_RUNS))
    return found
