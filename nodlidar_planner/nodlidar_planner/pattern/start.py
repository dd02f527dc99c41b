"""Where a nod begins: the phase of a start pitch."""

from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.pattern import HALF_SAMPLE, Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from numpy.typing import NDArray

# A whole number of samples past the limit shall be one, however the pitch was rounded: whether
# it is decides which directions are distinct.
PHASE_DECIMALS = 8


def phase_at(
    task: Task, samples: NDArray[np.int64], start_pitch: float | None
) -> NDArray[np.float64]:
    """Return the phase of each N_s that begins at a pitch [rad], going up; shape as that of N_s.

    Without a pitch it is half a sample past the lower limit.

    Raises
    ------
    ParameterError
        If the pitch lies outside the limits of the nod.
    """
    if start_pitch is None:
        return np.full(np.shape(samples), HALF_SAMPLE)
    if not task.pitch_min <= start_pitch <= task.pitch_max:
        limit = f'between pitch_min = {task.pitch_min} and pitch_max = {task.pitch_max} rad'
        raise ParameterError('start_pitch', limit, start_pitch)
    phase = samples * ((start_pitch - task.pitch_min) / task.span)
    return np.asarray(np.round(phase, PHASE_DECIMALS))


def pattern_from(task: Task, samples_per_sweep: int, start_pitch: float | None) -> Pattern:
    """Return the pattern of a nod over a task's region that begins at a pitch; see `phase_at`."""
    phase = float(phase_at(task, np.array(samples_per_sweep), start_pitch))
    return Pattern(task.steps_per_revolution, samples_per_sweep, phase)
