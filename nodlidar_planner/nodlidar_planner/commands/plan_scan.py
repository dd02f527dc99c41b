"""The command `plan_scan`, which chooses the nod that finds an object soonest."""

from collections.abc import Sequence
from dataclasses import replace
import json
import math
from pathlib import Path

from nodlidar_common.arrays import Integers
from nodlidar_common.errors import ParameterError
from nodlidar_common.terminal import result_console
from nodlidar_planner.choice.choice import plans
from nodlidar_planner.choice.front import Front
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.choice.plan import evaluate
from nodlidar_planner.choice.survey import survey
from nodlidar_planner.choice.timing_error import under_error
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.start import pattern_from
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.plan_scan.error_report import error_report, write_error_picture
from nodlidar_planner.plan_scan.options import as_option, objective_of, parse, Request
from nodlidar_planner.plan_scan.progress import progress
from nodlidar_planner.plan_scan.table import Answer, as_json, print_answer
import numpy as np

SHOWN_UNDER_ERROR = 120  # N_s for which runs under a timing error are drawn
RUNS_UNDER_ERROR = range(2000, 2016)  # their seeds; few runs suffice for a picture
ON_FRONT_UNDER_ERROR = 60  # N_s considered for the front under a timing error
# Cells of all N_s together that are considered for the completion under a timing error. It takes a
# minute, and neighbours are alike.
CELLS_UNDER_ERROR = 10_000_000


def main(argv: Sequence[str] | None) -> None:
    """Plan a scan as a command line requests.

    Raises
    ------
    ParameterError
        If a value is not allowed, naming its option.
    OSError
        If the picture cannot be written.
    SystemExit
        As `parse`.
    """
    try:
        _plan_scan(*parse(argv))
    except ParameterError as error:
        raise as_option(error) from error


def _plan_scan(task: Task, request: Request, errors: ErrorParameters) -> None:
    if request.error_budget and request.samples_per_sweep is not None:
        error_report(task, task.speed(request.samples_per_sweep), errors)  # refuses at once
    answer = find(task, request)
    if request.error_budget:
        answer = replace(answer, errors=error_report(task, answer.plans[0].speed, errors))
    if request.plot is not None and request.error_budget:
        write_error_picture(Path(request.plot), task, answer.plans[0].speed, errors)
    elif request.plot is not None:
        _plot(Path(request.plot), answer, request)
    console = result_console()
    if request.json:
        alternatives = request.top is not None and request.top > 1
        console.out(json.dumps(as_json(answer, alternatives), indent=2, allow_nan=False))
    else:
        print_answer(answer, console)


def find(task: Task, request: Request) -> Answer:
    """Return the best plans for a request, or the plan of its N_s."""
    if request.on_the_front:
        return _on_the_front(task, request)
    objective = objective_of(request.objective)
    start, error = request.start_pitch, request.error
    if request.samples_per_sweep is not None:
        n_s = request.samples_per_sweep
        plan = evaluate(task, n_s, start, error, objective.hole_after, progress=progress)
        return Answer(task, objective, request.servo, [plan])
    samples = _samples(task, request, CELLS_UNDER_ERROR // task.cells)
    count = request.top or (1 if request.json else 10)
    best = plans(task, samples, objective, start, error, count, progress)
    if error == 0.0:
        return Answer(task, objective, request.servo, best)
    n_s = plans(task, samples, objective, start, 0.0, 1, progress)[0].samples_per_sweep
    fewest = int(samples.min())
    nominal = evaluate(task, n_s, start, error, objective.hole_after, fewest, progress)
    return Answer(task, objective, request.servo, best, nominal)


def _on_the_front(task: Task, request: Request) -> Answer:
    """Return the nod at the corner of the front that satisfies a request's limits."""
    samples = _samples(task, request, ON_FRONT_UNDER_ERROR)
    front = Front(task, samples, request.start_pitch, request.error, progress)
    largest = None if request.max_hole is None else math.radians(request.max_hole)
    corner = front.choose(request.time_budget, largest)
    objective = Objective(hole_after=corner.time)
    plan = evaluate(
        task,
        corner.samples_per_sweep,
        request.start_pitch,
        request.error,
        corner.time,
        fewest_samples=int(samples.min()),
        progress=progress,
    )
    return Answer(task, objective, request.servo, [plan], front=front.around(corner))


def _samples(task: Task, request: Request, most_under_error: int) -> Integers:
    """Return the N_s to choose from; about so many at most with a timing error, for its runs."""
    if request.samples_per_sweep is not None:
        return np.array([request.samples_per_sweep])
    samples = samples_in_band(task, request.slowest(task), request.fastest(task))
    return samples if request.error == 0.0 else _thinned(samples, most_under_error)


def _thinned(samples: Integers, most: int) -> Integers:
    """Return about so many N_s at most, evenly spread."""
    return samples[:: max(1, round(len(samples) / max(most, 1)))]


def _plot(path: Path, answer: Answer, request: Request) -> None:
    # Imported here, since importing matplotlib takes as long as everything else.
    from nodlidar_planner.plan_scan.front_picture import write_front_picture
    from nodlidar_planner.plan_scan.pictures import Candidates, write_picture

    if answer.front:
        instant = answer.objective.hole_after
        write_front_picture(path, answer.task, answer.plans[0], instant, answer.front)
        return
    task, start = answer.task, request.start_pitch
    samples = samples_in_band(task, request.slowest(task), request.fastest(task))
    completion = np.array([f.completion_time for f in survey(task, samples, start, progress)])
    under = []
    if request.error > 0.0:
        for n_s in progress(_thinned(samples, SHOWN_UNDER_ERROR).tolist()):
            pattern = pattern_from(task, n_s, start)
            under.append((n_s, under_error(task, pattern, request.error, RUNS_UNDER_ERROR)))
    candidates = Candidates(samples, completion, under)
    write_picture(path, task, answer.plans, candidates, answer.nominal)
