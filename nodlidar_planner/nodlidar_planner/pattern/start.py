"""The phase of a nod that starts at a given pitch."""

from nodlidar_common.arrays import Array, Integers
from nodlidar_common.errors import ParameterError
from nodlidar_planner.pattern.pattern import HALF_SAMPLE, Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np

# Rounds the phase so that a whole number stays whole in spite of a rounded pitch: which directions
# are distinct depends on it.
PHASE_DECIMALS = 8


def phase_at(task: Task, samples: Integers, start_pitch: float | None) -> Array:
    """Return the phase of each N_s for a start at a pitch [rad], going up; same shape as N_s.

    Without a pitch, the start is half a sample past the lower limit.

    Raises
    ------
    ParameterError
        If the pitch is outside the limits of the nod.
    """
    if start_pitch is None:
        return np.full(np.shape(samples), HALF_SAMPLE)
    if not task.pitch_min <= start_pitch <= task.pitch_max:
        limit = f'between pitch_min = {task.pitch_min} and pitch_max = {task.pitch_max} rad'
        raise ParameterError('start_pitch', limit, start_pitch)
    phase = samples * ((start_pitch - task.pitch_min) / task.span)
    return np.asarray(np.round(phase, PHASE_DECIMALS))


def pattern_from(task: Task, samples_per_sweep: int, start_pitch: float | None) -> Pattern:
    """Return the pattern over a task's region that starts at a pitch [rad]; see `phase_at`."""
    phase = float(phase_at(task, np.array(samples_per_sweep), start_pitch))
    return Pattern(task.steps_per_revolution, samples_per_sweep, phase)
