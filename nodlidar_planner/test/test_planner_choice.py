"""The choice of N_s by what it gives, also under errors of the servo's turns."""

from dataclasses import replace
import math

from nodlidar_common.errors import ParameterError
from nodlidar_planner.choice import choice, timing_error
from nodlidar_planner.choice.choice import plans, quick_choice
from nodlidar_planner.choice.objective import Objective
from nodlidar_planner.choice.plan import evaluate
from nodlidar_planner.choice.survey import survey
from nodlidar_planner.choice.timing_error import completion_run
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from planner_enumeration import enumerate_cells, PUBLISHED
import pytest

BAND = samples_in_band(PUBLISHED)


def test_the_choice_completes_in_less_than_half_the_time_of_the_published_one():
    best = plans(PUBLISHED, BAND, Objective(), count=1)[0]
    published = evaluate(PUBLISHED, 2745, start_pitch=PUBLISHED.pitch_min)
    assert best.figures.completion_time <= 6.3
    assert published.figures.completion_time == pytest.approx(13.13, abs=0.005)
    assert best.lower_bound < best.figures.completion_time


def test_weights_choose_by_what_they_weigh():
    task, samples = Task(0.4, 2.0), BAND[::50]
    figures = survey(task, samples)
    by_revisit = plans(task, samples, Objective(completion=0.0, revisit=1.0), count=2)
    assert by_revisit[0].figures.revisit_max == min(f.revisit_max for f in figures)
    by_hole = plans(task, samples, Objective(completion=0.0, hole=1.0, hole_after=2.0), count=99)
    holes = [plan.hole for plan in by_hole]
    assert holes == sorted(holes)
    assert len(holes) == len(samples)


@pytest.mark.parametrize('count', [1, 3, 10])
def test_ties_go_by_the_longest_revisit_and_then_by_the_hit_frequency(count):
    task = Task(0.93, 2.0, full_circle=True, steps_per_revolution=55)
    samples = np.array([n for n in range(107, 133) if math.gcd(n, 55) == 1])
    figures = dict(zip(samples.tolist(), survey(task, samples), strict=True))
    order = sorted(
        figures,
        key=lambda n_s: (
            figures[n_s].completion_time,
            figures[n_s].revisit_max,
            -figures[n_s].hit_frequency,
        ),
    )
    assert figures[order[0]].completion_time == figures[order[9]].completion_time
    best = plans(task, samples, Objective(), count=count)
    assert [plan.samples_per_sweep for plan in best] == order[:count]


def test_holes_that_rounding_makes_differ_tie():
    task = Task(0.3, 1.0, steps_per_revolution=49)
    best = plans(task, np.array([59, 67]), Objective(0.0, 0.0, 1.0, hole_after=0.7), count=2)
    assert best[0].hole == pytest.approx(best[1].hole, abs=1e-12)
    assert best[0].figures.revisit_max < best[1].figures.revisit_max


def test_a_weighted_choice_leaves_out_what_never_completes():
    samples = np.array([64, 4001, 1024, 4003])
    weighted = Objective(completion=1.0, revisit=0.5)
    found = [plan.samples_per_sweep for plan in plans(Task(), samples, weighted)]
    assert sorted(found) == [4001, 4003]
    with pytest.raises(
        ParameterError, match="'object_size' must be so large that some N_s hits every row"
    ):
        plans(Task(), samples[::2], weighted)
    with pytest.raises(ParameterError, match="'azimuth' must be such that each of the"):
        plans(Task(azimuth=3.0), samples, Objective(completion=0.0, revisit=1.0))


def test_survey_shows_what_it_goes_through():
    shown = []
    assert (
        len(survey(Task(), BAND[:3], progress=lambda samples: shown.extend(samples) or shown)) == 3
    )
    assert shown == [1001, 1003, 1005]


def test_the_timing_errors_that_were_measured_before():
    median = evaluate(PUBLISHED, 2745, PUBLISHED.pitch_min, 0.003).under_error.median
    assert median == pytest.approx(22.0, abs=2.5)
    median = evaluate(PUBLISHED, 1057, PUBLISHED.pitch_min, 0.001).under_error.median
    assert median == pytest.approx(17.9, abs=2.5)


def test_the_quick_choice_for_an_error_completes_sooner_than_the_nominal_one_under_it():
    error, fresh = 0.003, range(5000, 5020)
    nominal, robust = quick_choice(PUBLISHED, BAND), quick_choice(PUBLISHED, BAND, error)
    medians = [
        np.median([completion_run(PUBLISHED, n_s, 0.5, error, seed) for seed in fresh])
        for n_s in (nominal, robust)
    ]
    assert medians[0] >= 1.5 * medians[1]


def test_planning_for_an_error_of_many_steps_halves_the_time_under_it():
    lidar = {'steps_per_revolution': 1440, 'scan_rate': 40.0, 'azimuth': 2.3562}
    task = Task(0.3, 4.0, **lidar, window_min=-2.3562, window_max=2.3562)
    samples = samples_in_band(task, 1.57, 6.0)[::64]
    error, fresh = 0.003, range(5000, 5020)
    medians = [
        np.median(
            [completion_run(task, best.samples_per_sweep, 0.5, error, seed) for seed in fresh]
        )
        for best in (
            plans(task, samples, Objective(), timing_error=planned_for, count=1)[0]
            for planned_for in (0.0, error)
        )
    ]
    assert medians[1] <= 0.5 * medians[0]


@pytest.mark.parametrize('error', [0.0, 0.003])
def test_of_nods_that_all_serve_alike_the_slowest_is_chosen(error):
    """Where there is one row of cells, every nod sees each of them in each revolution."""
    task = Task(pitch_min=-0.0175, pitch_max=0.0175)
    samples = np.arange(313, 8001, 16)
    best = plans(task, samples, Objective(), timing_error=error, count=2)
    assert [each.samples_per_sweep for each in best] == [7993, 7977]
    assert quick_choice(task, samples[::-1], error) == 7993


def test_without_error_the_quick_choice_is_the_exact_one():
    assert (
        quick_choice(PUBLISHED, BAND) == plans(PUBLISHED, BAND, Objective())[0].samples_per_sweep
    )


def test_an_error_wider_than_the_rows_still_ends_in_a_choice():
    task = Task(0.02, 2.0)
    assert quick_choice(task, samples_in_band(task)[::40], timing_error=0.05) in BAND


def test_a_choice_searches_no_margin_and_simulates_no_run_twice(monkeypatch):
    timing_error.completion_run.cache_clear()
    searched, simulated = [], []
    soonest, reversal_instants = choice.soonest, timing_error.reversal_instants

    def search(task, samples, margin, *rest):
        searched.append(margin)
        return soonest(task, samples, margin, *rest)

    def simulate(*run):
        simulated.append(run)
        return reversal_instants(*run)

    monkeypatch.setattr(choice, 'soonest', search)
    monkeypatch.setattr(timing_error, 'reversal_instants', simulate)
    monkeypatch.setattr(choice, 'evaluate', lambda _, n_s, *__: n_s)
    task = Task(0.1, 2.0, azimuth=0.05)
    plans(task, np.arange(4001, 4021, 2), Objective(), timing_error=0.02)
    assert len(set(searched)) == len(searched) > len(choice.MARGINS)
    assert len(set(simulated)) == len(simulated) >= max(choice.CHOOSING_RUNS)


def test_what_never_completes_is_refused_by_name():
    with pytest.raises(ParameterError, match=r"'object_size' must be at least 0\.03068 m"):
        plans(Task(0.001, 5.0), BAND, Objective())
    with pytest.raises(
        ParameterError, match="'object_size' must be so large that some N_s hits every row"
    ):
        plans(Task(0.02, 2.0), np.array([17]), Objective())
    with pytest.raises(ParameterError, match="'azimuth' must be such that each of the"):
        plans(Task(azimuth=3.0), BAND, Objective())
    circle = Task(0.3, 2.0, full_circle=True, steps_per_revolution=37)  # columns between its steps
    with pytest.raises(ParameterError, match=r"'object_size' must be at least 0\.3393 m"):
        plans(circle, BAND, Objective())
    with pytest.raises(ParameterError, match='timing_error'):
        plans(Task(), BAND, Objective(revisit=1.0), timing_error=0.001)
    with pytest.raises(ParameterError, match='start_pitch'):
        evaluate(Task(), 4001, start_pitch=1.0)


@pytest.mark.parametrize(
    'weights', [{'completion': -1.0}, {'completion': 0.0}, {'hole': math.nan}, {'hole_after': 0.0}]
)
def test_objectives_that_are_none_are_refused(weights):
    with pytest.raises(ParameterError):
        Objective(**weights)


def test_a_pattern_that_leaves_cells_out_is_evaluated_all_the_same():
    plan = evaluate(PUBLISHED, 1024)
    assert plan.figures.completion_time == math.inf
    assert 0.0 < plan.figures.never_hit_share < 1.0
    assert plan.distinct_directions == Pattern(1024, 1024).distinct_directions


def test_a_lidar_with_a_wider_window_is_planned_for_all_of_it():
    """The UST-10LX: 1081 of 1440 steps, 270 degrees, 40 Hz."""
    ends = 0.75 * math.pi
    task = Task(
        azimuth=ends,
        steps_per_revolution=1440,
        scan_rate=40.0,
        window_min=-ends,
        window_max=ends,
    )
    (plan,) = plans(task, np.array([1999, 2003]), Objective(), count=1)
    enumerated = enumerate_cells(task, Pattern(1440, plan.samples_per_sweep))
    assert plan.figures.cells == math.ceil(1.5 * math.pi / task.cell) * 25
    assert plan.figures.completion_time == enumerated.first.max() * task.beam_period
    with pytest.raises(ParameterError, match="'azimuth' must be such that each of the 95 columns"):
        plans(replace(task, window_max=2.0), samples_in_band(task), Objective(), count=1)
