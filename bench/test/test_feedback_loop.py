"""Coverage with the loop closed does what the documentation says."""

import math

import numpy as np

from bench.nod import feedback_loop
from bench.nod.servo_rig import Faults


def test_with_the_emulated_servo_all_cells_are_seen_again_and_again(monkeypatch):
    monkeypatch.setattr(feedback_loop, 'DURATION', 40.0)
    rounds = feedback_loop.rounds('feedback', 4001, Faults(0.003), 1)
    assert len(rounds) >= 4
    assert max(rounds) < 14.0
    assert float(np.median(rounds)) < 9.0


def test_the_default_nod_sees_all_cells_soonest_of_its_speed_with_a_servo_by_physics(monkeypatch):
    monkeypatch.setattr(feedback_loop, 'DURATION', 20.0)
    default, feedback, published = (
        np.median(feedback_loop.rounds(mode, n_s, feedback_loop.SERVOS['RX-24F'], 1))
        for mode, n_s in (
            ('coprime', feedback_loop.DEFAULT),
            ('feedback', feedback_loop.DEFAULT),
            ('coprime', 4001),
        )
    )
    assert default <= feedback
    assert default < 0.8 * published


def test_the_rounds_account_for_the_whole_time_once_the_servo_is_settled(monkeypatch):
    monkeypatch.setattr(feedback_loop, 'DURATION', 20.0)
    rounds = feedback_loop.rounds('coprime', 7547, feedback_loop.SERVOS['RX-24F'], 0)
    assert sum(rounds) >= 20.0 - feedback_loop.SETTLED - max(rounds)


def test_rounds_that_are_given_up_count(monkeypatch):
    monkeypatch.setattr(feedback_loop, 'DURATION', 9.0)
    monkeypatch.setattr(feedback_loop, 'LONGEST_ROUND', 3.0)
    rounds = feedback_loop.rounds('coprime', 7547, feedback_loop.SERVOS['RX-24F'], 0)
    # Given up after the first scan past 3 s, the 31st; two of these take 6.2 s.
    assert rounds == [math.inf] * 3
