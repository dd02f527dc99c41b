"""A nod with its figures."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from nodlidar_planner.choice.objective import HOLE_AFTER
from nodlidar_planner.choice.timing_error import hole_under_error, under_error, UnderError
from nodlidar_planner.coverage.coverage import Coverage, Figures
from nodlidar_planner.coverage.lower_bound import lower_bound
from nodlidar_planner.holes.hole import largest_hole
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import Task

Progress = Callable[[Iterable[Any]], Iterable[Any]]

# Seeds of the reported runs: not those of the choice, in which the chosen nod was lucky.
REPORTED_RUNS = range(1000, 1100)
HOLE_RUNS = REPORTED_RUNS[:25]


@dataclass(frozen=True, slots=True)
class Plan:
    """A nod with its figures.

    Attributes
    ----------
    samples_per_sweep, phase
        N_s, and samples that the nod is past its lower limit at sample 0.
    speed, sweep_duration
        Speed [rad/s] and duration of one sweep [s].
    figures
        Completion, revisits and hit frequency.
    hole
        Side of the largest hole after the objective's time [rad].
    lower_bound
        Completion time that no nod of the band can beat [s].
    distinct_directions
        Number of distinct directions in the pattern's period.
    under_error
        Completion under the servo's timing error [s]; None without timing error.
    hole_under_error
        Largest hole under it [rad]; None without timing error.
    """

    samples_per_sweep: int
    phase: float
    speed: float
    sweep_duration: float
    figures: Figures
    hole: float
    lower_bound: float
    distinct_directions: int
    under_error: UnderError | None
    hole_under_error: UnderError | None


def evaluate(
    task: Task,
    samples_per_sweep: int,
    start_pitch: float | None = None,
    timing_error: float = 0.0,
    hole_after: float = HOLE_AFTER,
    fewest_samples: int | None = None,
    progress: Progress = iter,
) -> Plan:
    """Return a nod's figures; see `plans` for the parameters.

    The lower bound is for nods of at least `fewest_samples` (default: this nod's N_s). `progress`
    wraps the iteration over the runs with a timing error.
    """
    pattern = pattern_from(task, samples_per_sweep, start_pitch)
    figures = Coverage(task, pattern).figures()
    completion = hole = None
    if timing_error > 0.0:
        completion = under_error(task, pattern, timing_error, progress(REPORTED_RUNS))
        runs = progress(HOLE_RUNS)
        hole = hole_under_error(task, pattern, hole_after, timing_error, runs)
    return Plan(
        samples_per_sweep=samples_per_sweep,
        phase=pattern.phase,
        speed=task.speed(samples_per_sweep),
        sweep_duration=samples_per_sweep * task.beam_period,
        figures=figures,
        hole=largest_hole(task, pattern, hole_after).side,
        lower_bound=lower_bound(task, fewest_samples or samples_per_sweep),
        distinct_directions=pattern.distinct_directions,
        under_error=completion,
        hole_under_error=hole,
    )
