"""The choice of the nod: the N_s of a band of speeds that is best for an objective."""

from collections.abc import Callable
from functools import cache
import math

from nodlidar_common.arrays import Integers
from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.choice.plan import evaluate, Plan, Progress
from nodlidar_planner.choice.search import soonest
from nodlidar_planner.choice.timing_error import under_error
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.holes.hole import largest_hole
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import column_runs, no_less_than, Task
import numpy as np

# Margins as parts of the timing error. Candidates that complete soonest with a margin do well in
# simulated runs; which margin is best depends on lidar, region and error. The quick choice uses
# one. The shortlist has the best SHORTLIST candidates with each; with those that tie with the
# last, up to twice as many.
QUICK_MARGIN = 0.75
MARGINS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
SHORTLIST = 12
# Runs of each in the shortlist, then of the best third of it, and again; of SHORTLIST at least.
CHOOSING_RUNS = (4, 12, 40)
# Holes equal to this many decimals [rad] count as equal; they differ by rounding.
HOLE_DECIMALS = 10


def quick_choice(task: Task, samples: Integers, timing_error: float = 0.0) -> int:
    """Return the N_s that completes soonest, with a margin against the timing error if possible.

    Takes about ten milliseconds, for a controller; `plans` also compares simulated runs.

    Parameters
    ----------
    task, samples
        Region, cells and lidar; the N_s to choose from, shape (n,), of which ties take the first.
    timing_error
        Standard deviation of the reversal instants [s].

    Raises
    ------
    ParameterError
        If no N_s ever completes.
    """
    margin = QUICK_MARGIN * timing_error / task.beam_period
    return int(_soonest(task, samples, None, 1, iter)(margin)[0])


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

    With a timing error, nods are ordered by the completion times of simulated runs: by the sum of
    mean and 90th percentile.

    Parameters
    ----------
    task
        Region, cells and lidar.
    samples
        The N_s to choose from, shape (n,).
    objective
        What to minimise. Ties are broken by the longest revisit, then by the hit frequency; of
        what is still equal, the slowest nod is first: servos follow it best.
    start_pitch
        Pitch at sample 0 [rad], going up; by default half a sample past the lower limit.
    timing_error
        Standard deviation of the reversal instants [s].
    count
        How many to return; fewer if no more complete.
    progress
        Wraps the iteration over the N_s, to show progress.

    Raises
    ------
    ParameterError
        If no N_s ever completes, or a timing error is combined with another objective.
    """
    if timing_error > 0.0 and not objective.only_completion:
        raise ParameterError('timing_error', '0 s unless completion alone counts', timing_error)
    fewest = int(samples.min())
    samples = np.sort(samples)[::-1]
    if timing_error > 0.0:
        chosen = _robust(task, samples, start_pitch, timing_error, progress)
    else:
        if objective.only_completion:
            samples = _soonest(task, samples, start_pitch, count, progress)(0.0)
        chosen = _ranked(task, samples, objective, start_pitch, progress)
    return [
        evaluate(task, n_s, start_pitch, timing_error, objective.hole_after, fewest)
        for n_s in progress(chosen[:count])
    ]


def _soonest(
    task: Task, samples: Integers, start_pitch: float | None, count: int, progress: Progress
) -> Callable[[float], Integers]:
    """Return the function that finds the N_s that complete soonest with a margin [samples].

    If none completes, the margin is halved until one does. Margins that meet are searched once.
    """
    _check_columns(task)
    # Random beams complete in about this time; a margin that needs longer does not help.
    at_random = task.rows * math.log(task.cells + 1) / task.scan_rate

    @cache
    def found(margin: float) -> Integers:
        limit = at_random if margin > 0.0 else math.inf
        best, _ = soonest(task, samples, margin, count, start_pitch, limit, progress)
        if len(best):
            return best
        if margin == 0.0:
            raise _no_rows(task)
        return found(margin / 2.0 if margin > 1.0 else 0.0)

    return found


def _check_columns(task: Task) -> None:
    """Raise ParameterError if some column has no beam, so that no nod ever completes."""
    seen = len(column_runs(task.column_of_step())[0])
    if seen < task.columns:
        step = math.tau / task.steps_per_revolution
        if task.cell < step:
            limit = no_less_than(step, task.distance)
            raise ParameterError('object_size', limit, task.object_size)
        key = 'object_size' if task.full_circle else 'azimuth'
        limit = f'such that each of the {task.columns} columns has a beam, not only {seen}'
        raise ParameterError(key, limit, getattr(task, key))


def _no_rows(task: Task) -> ParameterError:
    """Return the error for rows that no N_s hits."""
    allowed = 'so large that some N_s hits every row'
    return ParameterError('object_size', allowed, task.object_size)


def _robust(
    task: Task,
    samples: Integers,
    start_pitch: float | None,
    timing_error: float,
    progress: Progress,
) -> list[int]:
    """Return a shortlist, ordered by mean plus 90th percentile under the timing error."""
    error = timing_error / task.beam_period
    found = _soonest(task, samples, start_pitch, SHORTLIST, progress)
    shortlists = [found(share * error)[: 2 * SHORTLIST] for share in MARGINS]
    shortlist: list[int] = np.unique(np.concatenate(shortlists))[::-1].tolist()
    compared = len(shortlist)
    for runs in CHOOSING_RUNS:
        score = {}
        for n_s in progress(shortlist[:compared]):
            pattern = pattern_from(task, n_s, start_pitch)
            completion = under_error(task, pattern, timing_error, range(runs))
            score[n_s] = completion.expected + completion.p90
        shortlist[:compared] = sorted(score, key=lambda n_s: score[n_s])
        compared = max(compared // 3, SHORTLIST)
    return shortlist


def _ranked(
    task: Task,
    samples: Integers,
    objective: Objective,
    start_pitch: float | None,
    progress: Progress,
) -> list[int]:
    """Return the N_s that serve the objective, best first; raises ParameterError if none does."""
    ranks = {n_s: _rank(task, n_s, objective, start_pitch) for n_s in progress(samples.tolist())}
    served = [n_s for n_s in ranks if math.isfinite(ranks[n_s][0])]
    if not served:
        _check_columns(task)
        raise _no_rows(task)
    return sorted(served, key=lambda n_s: ranks[n_s])  # ties stay in the order of the samples


def _rank(
    task: Task, samples_per_sweep: int, objective: Objective, start_pitch: float | None
) -> tuple[float, float, float]:
    """Return the key that orders N_s, least first; computes the hole only if it has a weight."""
    pattern = pattern_from(task, samples_per_sweep, start_pitch)
    figures = Coverage(task, pattern).figures()
    score = 0.0
    if objective.completion > 0.0:
        score += objective.completion * figures.completion_time
    if objective.revisit > 0.0:
        score += objective.revisit * figures.revisit_max
    if objective.hole > 0.0:
        hole = largest_hole(task, pattern, objective.hole_after)
        score += objective.hole * round(hole.side, HOLE_DECIMALS)
    return score, figures.revisit_max, -figures.hit_frequency
