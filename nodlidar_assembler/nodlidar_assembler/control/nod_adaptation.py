"""The nod that goes with what is seen: limits from the median range, and the N_s to cover them.

For the limits that are being made for, the planner chooses the N_s about the planned one with
which the cells of the smallest object are seen soonest by a servo that turns inexactly. The choice
stays until limits or cells have become others, or the servo cannot hold it: it does not hunt.
"""

from dataclasses import replace
import math

from nodlidar_assembler.control.nod_clock import NodShape
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimits
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.schedule import even_rows
import numpy as np
from numpy.typing import NDArray

# N_s is chosen from between the planned one divided and multiplied by this.
BAND = 1.25
# How many are compared, and what they may add up to: the command waits. Under a timing error
# neighbours complete alike, so more would hardly find better ones.
CHOICES, SAMPLES = 32, 256_000
# A choice stays until span or cell differ by more than this share from what it was made for, or
# the servo could do with an N_s that is less by as much, lest it hunt.
MARGIN = 0.1


def fewest_samples(span: float, fastest: float, acceleration: float, beam_period: float) -> int:
    """Return the N_s from which on a servo gets over a span [rad] from turn to turn.

    Parameters
    ----------
    span
        From limit to limit [rad].
    fastest, acceleration
        What the servo holds [rad/s] and is sure to reach [rad/s^2]: between two turns it speeds up
        and brakes, which takes 2 sqrt(span / acceleration) at least.
    beam_period
        Of the lidar, dark steps counted [s].
    """
    shortest = max(span / fastest, 2.0 * math.sqrt(span / acceleration))
    return math.ceil(shortest / beam_period)


def choices(planned: int, fewest: int, steps_per_revolution: int) -> NDArray[np.int64]:
    """Return N_s to choose from, the nearest to the planned one first, shape (n,).

    All are coprime with N_L; none is below the fewest, from which on they are where that is beyond
    the planned one.

    Parameters
    ----------
    planned
        N_s that is wanted.
    fewest
        N_s at which the servo is as fast as it can be.
    steps_per_revolution
        N_L, dark steps counted.
    """
    usual = max(planned, fewest)
    count = min(max(SAMPLES // usual, 2), CHOICES)
    spread = np.linspace(max(planned / BAND, fewest), usual * BAND, count)
    taken = [usual, *np.ceil(spread).astype(np.int64).tolist()]
    coprime = {coprime_from(n_s, steps_per_revolution) for n_s in taken}
    return np.array(sorted(coprime, key=lambda n_s: abs(n_s - usual)), dtype=np.int64)


def coprime_from(samples_per_sweep: int, steps_per_revolution: int) -> int:
    """Return the least number from an N_s on that has no divisor in common with N_L."""
    while math.gcd(samples_per_sweep, steps_per_revolution) > 1:
        samples_per_sweep += 1
    return samples_per_sweep


class NodAdaptation:
    """Gives the shape of the nod at any instant.

    Parameters
    ----------
    limits
        Told of scans and of motion by whoever has them.
    task
        The smallest object, the greatest distance that it is looked for at, and the lidar.
    planned
        N_s that is wanted.
    fastest, acceleration
        What the servo holds [rad/s] and is sure to reach [rad/s^2].
    timing_error
        Standard deviation of the instants at which the servo turns [s].

    Raises
    ------
    ParameterError
        If N_s, speed or acceleration is not positive, or the error negative.
    """

    def __init__(
        self,
        limits: PitchLimits,
        task: Task,
        planned: int,
        fastest: float,
        acceleration: float,
        timing_error: float,
    ) -> None:
        if planned < 1:
            raise ParameterError('samples_per_sweep', 'at least 1', planned)
        if not 0.0 < fastest < math.inf:
            raise ParameterError('fastest', 'above 0 rad/s and finite', fastest)
        if not 0.0 < acceleration < math.inf:
            raise ParameterError('acceleration', 'above 0 rad/s^2 and finite', acceleration)
        if not 0.0 <= timing_error < math.inf:
            raise ParameterError('timing_error', 'at least 0 s and finite', timing_error)
        self.limits = limits
        self._task, self._planned = task, planned
        self._fastest, self._acceleration = fastest, acceleration
        self._timing_error = timing_error
        self._samples = 0
        self._chosen_for: Task | None = None

    def shape(self, time_ns: int, beam_period: float) -> NodShape:
        """Return limits and N_s at an instant [ns], with the lidar's beam period [s].

        Raises
        ------
        ParameterError
            If the instant lies before that of the last call.
        """
        low, high = self.limits.limits(time_ns)
        task = self._task_ahead()
        # The servo must hold it on the way from wider limits, too.
        widest = max(high - low, task.span)
        fewest = fewest_samples(widest, self._fastest, self._acceleration, beam_period)
        if not self._stays(task, fewest):
            self._samples, self._chosen_for = self._choice(task, fewest, beam_period), task
        return NodShape(low, high, self._samples)

    def _task_ahead(self) -> Task:
        """Return the cells between the limits that are being made for, as far away as these are.

        An object that is as near as it is wide is the nearest that is thought of.
        """
        config, distance, task = self.limits.config, self.limits.followed, self._task
        low, high = config.pitch_min, config.pitch_max
        if distance is not None:
            low, high = limits_at(config, distance)
            task = replace(task, distance=min(max(distance, task.object_size), task.distance))
        return replace(task, pitch_min=low, pitch_max=high)

    def _stays(self, task: Task, fewest: int) -> bool:
        if self._chosen_for is None:
            return False
        most = math.ceil(max(self._planned, fewest * (1.0 + MARGIN)) * BAND)
        return (
            fewest <= self._samples <= coprime_from(most, task.steps_per_revolution)
            and _alike(task.span, self._chosen_for.span)
            and _alike(task.cell, self._chosen_for.cell)
        )

    def _choice(self, task: Task, fewest: int, beam_period: float) -> int:
        """Return the N_s that sees all cells soonest.

        It is the one nearest to the planned one where none ever does (cells narrower than a step)
        or the lidar turns as none does.
        """
        samples = choices(self._planned, fewest, task.steps_per_revolution)
        rate = 1.0 / (beam_period * task.steps_per_revolution)
        try:
            # How soon it hits what little of a row is left says nothing about how even it is.
            even = replace(even_rows(task), scan_rate=rate)
            return quick_choice(even, samples, self._timing_error)
        except ParameterError:
            return int(samples[0])


def _alike(value: float, other: float) -> bool:
    return max(value, other) <= (1.0 + MARGIN) * min(value, other)
