"""N_s that are coprime with N_L: the next one, and all within a band of nod speeds."""

import math

from nodlidar_common.arrays import Integers
from nodlidar_common.errors import ParameterError
from nodlidar_common.rounding import rounded_down, rounded_up
from nodlidar_planner.pattern.pattern import MAX_SAMPLES_PER_SWEEP
from nodlidar_planner.pattern.task import Task
import numpy as np

# The published band of N_s, for an N_L of 1024 and 10 revolutions per second: this long a sweep
# takes at least and at most [s].
USEFUL_SWEEP = 1001 / 10_240, 8000 / 10_240
MAX_CHOICES = 200_000


def coprime_from(number: int, other: int) -> int:
    """Return the least number, at least a given one, that is coprime with another."""
    while math.gcd(number, other) != 1:
        number += 1
    return number


def coprime_up_to(number: int, other: int) -> int:
    """Return the greatest number, at most a given one from 1 on, that is coprime with another."""
    while math.gcd(number, other) != 1:
        number -= 1
    return number


def samples_in_band(
    task: Task, speed_min: float | None = None, speed_max: float | None = None
) -> Integers:
    """Return the N_s, shape (n,), coprime with N_L, whose nod speed [rad/s] is within a band.

    A limit defaults to the one of USEFUL_SWEEP.

    Raises
    ------
    ParameterError
        If a limit is no speed or too slow to be planned, the limits are in the wrong order, or no
        N_s lies between them.
    """
    for key, speed in (('speed_min', speed_min), ('speed_max', speed_max)):
        if speed is not None and not 0.0 < speed < math.inf:
            raise ParameterError(key, 'above 0 rad/s and finite', speed)
    one_sample = task.speed(1)
    fewest, most = (duration / task.beam_period for duration in USEFUL_SWEEP)
    if speed_max is not None:
        fewest = one_sample / speed_max
    if speed_min is not None:
        most = one_sample / speed_min
    fewest, most = math.ceil(fewest - 1e-9), math.floor(most + 1e-9)
    if most - fewest > MAX_CHOICES:
        least = rounded_up(task.speed(fewest + MAX_CHOICES))
        limit = f'at least {least} rad/s, for {MAX_CHOICES} choices'
        raise ParameterError('speed_min', limit, speed_min or task.speed(most))
    if most > MAX_SAMPLES_PER_SWEEP:
        slowest = task.speed(MAX_SAMPLES_PER_SWEEP)
        limit = f'at least {rounded_up(slowest)} rad/s, for N_s up to {MAX_SAMPLES_PER_SWEEP}'
        if speed_max is not None and speed_max < slowest:
            raise ParameterError('speed_max', limit, speed_max)
        raise ParameterError('speed_min', limit, speed_min or task.speed(most))
    fewest = max(1, fewest)
    samples: Integers = np.arange(fewest, most + 1)
    samples = samples[np.gcd(samples, task.steps_per_revolution) == 1]
    if len(samples) == 0:
        raise _none_between(task, fewest, most, speed_min, speed_max)
    return samples


def _none_between(
    task: Task, fewest: int, most: int, speed_min: float | None, speed_max: float | None
) -> ParameterError:
    """Return the error for a band without N_s, which names a limit that was passed."""
    if speed_max is None or most < 1:
        n_s = coprime_from(fewest, task.steps_per_revolution)
        key, value = 'speed_min', speed_min
        limit = f'at most {rounded_down(task.speed(n_s))} rad/s, that of N_s = {n_s}'
    else:
        n_s = coprime_up_to(most, task.steps_per_revolution)
        key, value = 'speed_max', speed_max
        limit = f'at least {rounded_up(task.speed(n_s))} rad/s, that of N_s = {n_s}'
        limit += ', or speed_min given as well' if speed_min is None else ''
    if fewest <= most:
        limit = f'such that one N_s of {fewest} to {most} is coprime with N_L'
    return ParameterError(key, limit, value)
