"""The choice of the nod: the N_s that serves an objective best, at speeds that the servo holds."""

from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass
import math

from nodlidar_assembler.planner.coverage import column_runs, Coverage, Figures
from nodlidar_assembler.planner.hole import largest_hole
from nodlidar_assembler.planner.pattern import Pattern
from nodlidar_assembler.planner.search import phase_at, soonest
from nodlidar_assembler.planner.task import Task
from nodlidar_assembler.planner.timing_error import (
    hole_under_error,
    under_error,
    UnderError,
)
from nodlidar_common.errors import ParameterError
import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Progress = Callable[[Iterable[int]], Iterable[int]]

# The band of N_s that is useful with an N_L of 1024, and in proportion with others: faster nods
# are beyond the servo, slower ones beyond patience.
USEFUL_SAMPLES, OF_STEPS = (1001, 8000), 1024
# The largest hole is the one left after this time [s], unless an objective says otherwise.
HOLE_AFTER = 5.0
MAX_CHOICES = 200_000
# Parts of the timing error that hits must stay away from other rows by. What completes soonest
# with these does well in simulated runs, too; which part does best depends on the error. The
# quick choice has one part, the shortlist the best so many of each.
QUICK_GUARD = 0.75
GUARDS = (0.5, 0.75, 1.0)
SHORTLIST = 12
# Runs to choose by, and others to report: what was best in the former was lucky, too.
CHOOSING_RUNS, REPORTED_RUNS = range(40), range(1000, 1100)
HOLE_RUNS = REPORTED_RUNS[:25]
# Enough to show how a whole band fares.
SURVEY_RUNS = range(2000, 2016)


@dataclass(frozen=True, slots=True)
class Objective:
    """What a nod shall be good at: the weighted sum that is to be least.

    Attributes
    ----------
    completion, revisit, hole
        Weights of the completion time [1/s], the longest revisit time [1/s] and the largest hole
        [1/rad].
    hole_after
        The hole is the one left after this time [s].
    """

    completion: float = 1.0
    revisit: float = 0.0
    hole: float = 0.0
    hole_after: float = HOLE_AFTER

    def __post_init__(self) -> None:
        weights = self.completion, self.revisit, self.hole
        for key, weight in zip(('completion', 'revisit', 'hole'), weights, strict=True):
            if not 0.0 <= weight < math.inf:
                raise ParameterError(key, 'a weight of at least 0', weight)
        if not any(weights):
            raise ParameterError('objective', 'a weight above 0 for something', weights)
        if not 0.0 < self.hole_after < math.inf:
            raise ParameterError('hole_after', 'above 0 s', self.hole_after)

    @property
    def only_completion(self) -> bool:
        """Whether nothing but the completion time counts."""
        return self.revisit == self.hole == 0.0


@dataclass(frozen=True, slots=True)
class Plan:
    """A nod and what it gives.

    Attributes
    ----------
    samples_per_sweep, phase
        N_s, and samples that the nod is past its lower limit at sample 0.
    speed, sweep_duration
        Speed [rad/s] and time of one sweep [s].
    figures
        Completion, revisits and hit frequency.
    hole
        Side of the largest hole [rad], after the objective's time.
    lower_bound
        Completion time that no nod of the band can beat [s].
    distinct_directions
        Directions that the pattern ever points to.
    under_error
        Completion under the servo's timing error, if one was given.
    hole_under_error
        The largest hole under it [rad].
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


def samples_in_band(
    task: Task, speed_min: float | None = None, speed_max: float | None = None
) -> Integers:
    """Return the N_s, coprime with N_L, at which the nod's speed [rad/s] lies in a band.

    A limit that is not given is that of USEFUL_SAMPLES.

    Raises
    ------
    ParameterError
        If the limits are no speeds, in the wrong order, or no N_s lies between them.
    """
    for key, speed in (('speed_min', speed_min), ('speed_max', speed_max)):
        if speed is not None and not 0.0 < speed < math.inf:
            raise ParameterError(key, 'above 0 rad/s and finite', speed)
    one_sample = task.speed(1)
    fewest, most = (n_s * task.steps_per_revolution / OF_STEPS for n_s in USEFUL_SAMPLES)
    if speed_max is not None:
        fewest = one_sample / speed_max
    if speed_min is not None:
        most = one_sample / speed_min
    fewest, most = math.ceil(fewest - 1e-9), math.floor(most + 1e-9)
    if most - fewest > MAX_CHOICES:
        limit = f'at least {task.speed(fewest + MAX_CHOICES):.3g} rad/s, for {MAX_CHOICES} choices'
        raise ParameterError('speed_min', limit, speed_min)
    samples: Integers = np.arange(max(1, fewest), most + 1)
    samples = samples[np.gcd(samples, task.steps_per_revolution) == 1]
    if len(samples) == 0:
        limit = f'above the lower limit and such that an N_s of {fewest} to {most} is allowed'
        raise ParameterError('speed_max', limit, speed_max)
    return samples


def lower_bound(task: Task, fewest_samples: int) -> float:
    """Return a completion time [s] that no nod from limit to limit can beat.

    A cell is hit anew only where the lidar enters its column or the nod its row; so no more cells
    are hit than columns and rows are entered. The nod enters no more rows than at its highest
    speed, even if speed and turns are chosen at will.

    Parameters
    ----------
    task
        What must be covered.
    fewest_samples
        The N_s of the highest speed.
    """
    column_of_step = task.column_of_step()
    starts, _ = column_runs(column_of_step)
    if len(starts) < task.columns:
        return math.inf
    entries = np.bincount(starts, minlength=len(column_of_step)).cumsum()
    measured = (column_of_step >= 0).cumsum()
    height = max(1.0, task.row_height(fewest_samples))

    def cells_hit(n: int) -> int:
        revolutions, step = divmod(n, len(entries))
        columns = revolutions * entries[-1] + entries[step]
        measuring = revolutions * measured[-1] + measured[step]
        # Two rows may be entered at once more: one at either end of a stretch, at a turn.
        return int(columns + measuring / height) + 2 * (revolutions + 1)

    most = task.rows * task.steps_per_revolution
    return bisect_left(range(most), task.cells, key=cells_hit) * task.sample_time


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
        What must be covered.
    samples
        N_s, shape (n,).
    start_pitch
        Pitch at sample 0 [rad], going up; half a sample past the lower limit if not given.
    progress
        Wraps the N_s while they are gone through, to show it.
    """
    return [_coverage(task, n_s, start_pitch).figures() for n_s in progress(samples.tolist())]


def survey_under_error(
    task: Task,
    samples: Integers,
    timing_error: float,
    start_pitch: float | None = None,
    progress: Progress = iter,
) -> list[UnderError]:
    """Return what a few simulated runs of each N_s take; see `survey` and `plans`."""
    found = []
    for n_s in progress(samples.tolist()):
        phase = float(phase_at(task, np.array(n_s), start_pitch))
        found.append(under_error(task, n_s, phase, timing_error, SURVEY_RUNS))
    return found


def quick_choice(task: Task, samples: Integers, timing_error: float = 0.0) -> int:
    """Return the N_s that completes soonest, as far as possible with hits that an error spares.

    It takes some ten milliseconds: for a controller. `plans` compares by simulated runs, too.

    Parameters
    ----------
    task, samples
        What must be covered, and the N_s to choose from.
    timing_error
        Standard deviation of the instants at which the servo turns [s].

    Raises
    ------
    ParameterError
        If no N_s ever completes.
    """
    guard = QUICK_GUARD * timing_error / task.sample_time
    return int(_soonest(task, samples, guard, None, 1)[0])


def plans(
    task: Task,
    samples: Integers,
    objective: Objective,
    start_pitch: float | None = None,
    timing_error: float = 0.0,
    count: int = 10,
    progress: Progress = iter,
) -> list[Plan]:
    """Return the best nods, best first.

    With a timing error the completion times are those of simulated runs, of which mean and 90th
    percentile count alike.

    Parameters
    ----------
    task
        What must be covered.
    samples
        The N_s to choose from, shape (n,).
    objective
        What counts. Ties go by the longest revisit, then by the hit frequency.
    start_pitch
        Pitch at sample 0 [rad], going up; half a sample past the lower limit if not given.
    timing_error
        Standard deviation of the instants at which the servo turns [s].
    count
        How many to return; fewer if no more complete.
    progress
        Wraps the N_s while they are gone through, to show it.

    Raises
    ------
    ParameterError
        If no N_s ever completes, or a timing error is given for another objective.
    """
    if timing_error > 0.0 and not objective.only_completion:
        raise ParameterError('timing_error', '0 s unless completion alone counts', timing_error)
    fewest = int(samples.min())
    chosen: Iterable[int]
    if timing_error > 0.0:
        chosen = _robust(task, samples, start_pitch, timing_error, progress)[:count]
    elif objective.only_completion:
        chosen = _soonest(task, samples, 0.0, start_pitch, count).tolist()
    else:
        chosen = progress(samples.tolist())
    if timing_error == 0.0:
        ranks = {n_s: _rank(task, n_s, objective, start_pitch) for n_s in chosen}
        chosen = sorted(ranks, key=lambda n_s: ranks[n_s])[:count]
    return [
        evaluate(task, n_s, start_pitch, timing_error, objective.hole_after, fewest)
        for n_s in (progress(chosen) if timing_error > 0.0 else chosen)
    ]


def evaluate(
    task: Task,
    samples_per_sweep: int,
    start_pitch: float | None = None,
    timing_error: float = 0.0,
    hole_after: float = HOLE_AFTER,
    fewest_samples: int | None = None,
) -> Plan:
    """Return what a nod gives; the lower bound is for nods of the fewest samples, or as fast.

    See `plans` for the parameters.
    """
    coverage = _coverage(task, samples_per_sweep, start_pitch)
    phase = coverage.pattern.phase
    completion = hole = None
    if timing_error > 0.0:
        completion = under_error(task, samples_per_sweep, phase, timing_error, REPORTED_RUNS)
        hole = hole_under_error(task, coverage.pattern, hole_after, timing_error, HOLE_RUNS)
    return Plan(
        samples_per_sweep=samples_per_sweep,
        phase=phase,
        speed=task.speed(samples_per_sweep),
        sweep_duration=samples_per_sweep * task.sample_time,
        figures=coverage.figures(),
        hole=largest_hole(task, coverage.pattern, hole_after).side,
        lower_bound=lower_bound(task, fewest_samples or samples_per_sweep),
        distinct_directions=coverage.pattern.distinct_directions,
        under_error=completion,
        hole_under_error=hole,
    )


def _coverage(task: Task, samples_per_sweep: int, start_pitch: float | None) -> Coverage:
    phase = float(phase_at(task, np.array(samples_per_sweep), start_pitch))
    return Coverage(task, Pattern(task.steps_per_revolution, samples_per_sweep, phase))


def _soonest(
    task: Task, samples: Integers, guard: float, start_pitch: float | None, count: int
) -> Integers:
    """Return the N_s that complete soonest, with as much of the guard [samples] as any bears."""
    _check_columns(task)
    # Beams that fall at random complete in about as many revolutions; a guard shall help.
    at_random = task.rows * math.log(task.cells + 1) / task.scan_rate
    while True:
        limit = at_random if guard > 0.0 else math.inf
        found, _ = soonest(task, samples, guard, count, start_pitch, limit)
        if len(found):
            return found
        if guard == 0.0:
            allowed = 'so large that with some N_s every row has a beam'
            raise ParameterError('object_size', allowed, task.object_size)
        guard = guard / 2.0 if guard > 1.0 else 0.0


def _check_columns(task: Task) -> None:
    """Raise ParameterError if some column has no beam, so that nothing ever completes."""
    seen = len(column_runs(task.column_of_step())[0])
    if seen < task.columns:
        finer = task.cell < math.tau / task.steps_per_revolution
        key = 'object_size' if finer else 'azimuth'
        limit = f'such that each of the {task.columns} columns has a beam, not just {seen}'
        raise ParameterError(key, limit, getattr(task, key))


def _robust(
    task: Task,
    samples: Integers,
    start_pitch: float | None,
    timing_error: float,
    progress: Progress,
) -> list[int]:
    """Return a shortlist, in the order of mean and 90th percentile under the timing error."""
    error = timing_error / task.sample_time
    shortlists = [_soonest(task, samples, g * error, start_pitch, SHORTLIST) for g in GUARDS]
    shortlist = np.unique(np.concatenate(shortlists)).tolist()
    score = {}
    for n_s in progress(shortlist):
        phase = float(phase_at(task, np.array(n_s), start_pitch))
        runs = under_error(task, n_s, phase, timing_error, CHOOSING_RUNS)
        score[n_s] = runs.expected + runs.p90
    return sorted(shortlist, key=lambda n_s: score[n_s])


def _rank(
    task: Task, samples_per_sweep: int, objective: Objective, start_pitch: float | None
) -> tuple[float, float, float]:
    """Return what N_s are ordered by, least first; the hole is looked for only if it counts."""
    coverage = _coverage(task, samples_per_sweep, start_pitch)
    figures = coverage.figures()
    score = 0.0
    if objective.completion > 0.0:
        score += objective.completion * figures.completion_time
    if objective.revisit > 0.0:
        score += objective.revisit * figures.revisit_max
    if objective.hole > 0.0:
        hole = largest_hole(task, coverage.pattern, objective.hole_after)
        score += objective.hole * hole.side
    return score, figures.revisit_max, -figures.hit_frequency
