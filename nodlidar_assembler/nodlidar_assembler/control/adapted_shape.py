"""The shape of the nod for the range ahead: its limits, and the N_s to cover them.

For the limits that the nod is moving to, the planner chooses the N_s near the planned one that
sees the cells of the smallest object soonest, with a servo whose reversals scatter. The choice
stays until limits or cells change, or the servo cannot hold it: it does not hunt.
"""

from dataclasses import replace
import math

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.pitch_limits import limits_at, PitchLimits
from nodlidar_common.arrays import Integers
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import check
from nodlidar_planner.choice.choice import quick_choice
from nodlidar_planner.pattern.band import coprime_from
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.schedule import even_rows
import numpy as np

# Candidates lie between the planned N_s divided and multiplied by this.
BAND = 1.25
# At most this many candidates, with this many samples in all: the command waits for the choice.
# With a timing error neighbours complete alike, so more would hardly find better ones.
CANDIDATES, SAMPLES = 32, 256_000
# To prevent hunting, a choice stays until span or cell change by more than this share, or the
# fewest samples that the servo needs fall by as much.
MARGIN = 0.1


def candidates(planned: int, fewest: int, steps_per_revolution: int) -> Integers:
    """Return the candidates, the nearest to the planned N_s first, shape (n,).

    All are coprime with N_L. None is below the fewest; if the planned N_s is, the fewest replaces
    it.

    Parameters
    ----------
    planned
        Planned N_s.
    fewest
        N_s at the highest speed of the servo.
    steps_per_revolution
        N_L, dark steps included.
    """
    usual = max(planned, fewest)
    count = min(max(SAMPLES // usual, 2), CANDIDATES)
    spread = np.linspace(max(planned / BAND, fewest), usual * BAND, count)
    spread_out = [usual, *np.ceil(spread).astype(np.int64).tolist()]
    coprime = {coprime_from(n_s, steps_per_revolution) for n_s in spread_out}
    return np.array(sorted(coprime, key=lambda n_s: abs(n_s - usual)), dtype=np.int64)


class AdaptedShape:
    """The limits that follow the range, with an N_s for them.

    Parameters
    ----------
    limits
        Limits that the caller updates with scans and motion.
    config
        Planned N_s and servo; its limits do not count.
    task
        Cells in the window of the lidar, at the largest distance.

    Raises
    ------
    ParameterError
        For a configuration out of its ranges.
    """

    def __init__(self, limits: PitchLimits, config: NodConfig, task: Task) -> None:
        check(config)
        self.limits = limits
        self._config, self._task = config, task
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
        fewest = self._config.fewest_samples(widest, beam_period)
        if not self._stays(task, fewest):
            self._samples, self._chosen_for = self._choice(task, fewest, beam_period), task
        return NodShape(low, high, self._samples)

    def _task_ahead(self) -> Task:
        """Return the cells between the limits that the nod is moving to, at the range followed.

        The distance is at least the size of the object.
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
        most = math.ceil(max(self._config.samples_per_sweep, fewest * (1.0 + MARGIN)) * BAND)
        return (
            fewest <= self._samples <= coprime_from(most, task.steps_per_revolution)
            and _alike(task.span, self._chosen_for.span)
            and _alike(task.cell, self._chosen_for.cell)
        )

    def _choice(self, task: Task, fewest: int, beam_period: float) -> int:
        """Return the N_s that sees all cells soonest.

        It is the one nearest to the planned one if none ever does (cells narrower than a step) or
        the rate of rotation is impossible.
        """
        samples = candidates(self._config.samples_per_sweep, fewest, task.steps_per_revolution)
        rate = 1.0 / (beam_period * task.steps_per_revolution)
        try:
            # Whole rows only: how soon a partial row is hit does not show how even the nod is.
            even = replace(even_rows(task), scan_rate=rate)
            return quick_choice(even, samples, self._config.timing_error)
        except ParameterError:
            return int(samples[0])


def _alike(value: float, other: float) -> bool:
    return max(value, other) <= (1.0 + MARGIN) * min(value, other)
