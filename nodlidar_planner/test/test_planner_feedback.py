"""The choice of the next sweep, knowing where the beams went."""

import itertools
import math

from nodlidar_planner.choice.timing_error import completion_run
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.feedback import Feedback, SPREAD
from nodlidar_planner.sweeps.schedule import first_hits
import numpy as np
import pytest

TASK = Task(0.10, 2.0, -math.pi / 4, math.pi / 4, full_circle=True)
WINDOW = Task()


def fed_back(task, n_s, error, seed):
    """Return the reversals of a nod of chosen sweeps until all was seen, and its Feedback."""
    feedback, noise = Feedback(task, n_s, error), np.random.default_rng(seed)
    reversals, last = [-0.5], 0
    while feedback.unseen.any():
        going_up = len(reversals) % 2 == 1
        duration = feedback.next_duration(reversals[-1], going_up)
        assert (1 - SPREAD) * n_s <= duration <= (1 + SPREAD) * n_s
        reversal = reversals[-1] + duration + noise.normal(0.0, error / task.beam_period)
        new = feedback.saw(reversals[-1], reversal, going_up)
        last = new[-1] if len(new) else last
        reversals.append(reversal)
    return np.array(reversals), last * task.beam_period


@pytest.mark.parametrize(('task', 'n_s'), [(TASK, 4001), (WINDOW, 2500), (WINDOW, 1001)])
def test_what_was_seen_is_what_enumeration_sees(task, n_s):
    reversals, completion = fed_back(task, n_s, 0.003, seed=3)
    first = first_hits(task, reversals)
    assert first.max() * task.beam_period == pytest.approx(completion, abs=1e-9)


def test_a_sweep_marks_just_its_own_cells():
    feedback = Feedback(WINDOW, 2500, 0.0)
    reversals = np.array([-0.5, 2400.0, 5100.25, 7401.0])
    for k in range(3):
        feedback.saw(reversals[k], reversals[k + 1], going_up=k % 2 == 0)
    first = first_hits(WINDOW, reversals)
    assert np.array_equal(feedback.unseen, ~np.isfinite(first))


def test_beams_mark_what_their_sweep_does():
    """The same sweeps, by the reversals' instants and by where each of their beams points."""
    by_reversals, by_beams = Feedback(WINDOW, 2500, 0.0), Feedback(WINDOW, 2500, 0.0)
    reversals = np.array([-0.5, 2400.0, 5100.25, 7401.0])
    for k in range(3):
        by_reversals.saw(reversals[k], reversals[k + 1], going_up=k % 2 == 0)
    n = np.arange(math.ceil(reversals[-1]))
    limits = np.resize([WINDOW.pitch_min, WINDOW.pitch_max], len(reversals))
    by_beams.saw_beams(WINDOW.step_azimuth()[n % 1024], np.interp(n, reversals, limits))
    assert np.array_equal(by_reversals.unseen, by_beams.unseen)


def test_beams_beyond_the_limits_mark_nothing():
    feedback = Feedback(WINDOW, 2500, 0.0)
    feedback.saw_beams(np.zeros(2), np.array([WINDOW.pitch_min, WINDOW.pitch_max]) * 1.01)
    assert feedback.unseen.all()


def test_what_the_sweep_under_way_will_hit_is_not_gone_for_again():
    """It hits all of a patch; knowing that, the next one is much likelier to hit another cell."""

    def hits(under_way):
        count = 0
        for column, row in itertools.product(range(5, 120, 7), range(2, 30, 5)):
            feedback = Feedback(TASK, 4001, 0.0)
            feedback.unseen = patch.copy()
            feedback.unseen[column, row] = True
            duration = feedback.next_duration(4000.5, False, under_way)
            feedback.saw(4000.5, 4000.5 + duration, False)
            count += not feedback.unseen[column, row]
        return count

    present = Feedback(TASK, 4001, 0.0)
    present.saw(-0.5, 4000.5, True)
    patch = ~present.unseen
    patch[:40] = patch[42:] = False
    assert hits((-0.5, 4001.0)) > 1.5 * hits(None)


def test_the_choice_goes_for_what_is_left():
    """With one cell left that a sweep of some duration can hit, it is hit."""
    for column, row in ((20, 12), (60, 24), (100, 7)):
        feedback = Feedback(TASK, 4001, 0.0)
        feedback.unseen[:] = False
        feedback.unseen[column, row] = True
        reversal, going_up = -0.5, True
        for _ in range(8):
            duration = feedback.next_duration(reversal, going_up)
            feedback.saw(reversal, reversal + duration, going_up)
            reversal, going_up = reversal + duration, not going_up
        assert not feedback.unseen.any()


def test_cells_at_a_limit_are_hit_by_a_servo_that_passes_the_limit():
    """At the ends of each sweep it is beyond the limits: the beams there hit nothing."""

    def way(since, duration):
        return 0.5 + 1.15 * (since / duration - 0.5)

    for column in range(10, 120, 12):
        feedback = Feedback(TASK, 4001, 0.0)
        since = np.arange(4001.0)
        feedback.lateness.add(since, np.full(4001, 4001.0), way(since, 4001.0))
        feedback.unseen[:] = False
        feedback.unseen[column, 0] = True
        reversal, going_up = -0.5, True
        for _ in range(8):
            duration = feedback.next_duration(reversal, going_up)
            n = np.arange(math.ceil(reversal), math.ceil(reversal + duration))
            part = way(n - reversal, duration)
            height = part if going_up else 1.0 - part
            feedback.saw_beams(TASK.step_azimuth()[n % 1024], TASK.pitch_min + TASK.span * height)
            reversal, going_up = reversal + duration, not going_up
        assert not feedback.unseen.any()


def test_under_error_feedback_completes_much_sooner_than_the_planned_nod():
    n_s, error, seeds = 2500, 0.003, range(4)
    planned = np.median([completion_run(TASK, n_s, 0.5, error, seed) for seed in seeds])
    chosen = np.median([fed_back(TASK, n_s, error, seed)[1] for seed in seeds])
    assert chosen < 0.75 * planned
