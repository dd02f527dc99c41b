"""The figures of every N_s of a band, for pictures."""

from nodlidar_common.arrays import Integers
from nodlidar_planner.choice.plan import Progress
from nodlidar_planner.coverage.coverage import Coverage, Figures
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import Task


def survey(
    task: Task,
    samples: Integers,
    start_pitch: float | None = None,
    progress: Progress = iter,
) -> list[Figures]:
    """Return the figures of each N_s.

    Parameters
    ----------
    task
        Region, cells and lidar.
    samples
        N_s, shape (n,).
    start_pitch
        Pitch at sample 0 [rad], going up; by default half a sample past the lower limit.
    progress
        Wraps the iteration over the N_s, to show progress.
    """
    patterns = (pattern_from(task, n_s, start_pitch) for n_s in progress(samples.tolist()))
    return [Coverage(task, pattern).figures() for pattern in patterns]
