"""Coverage feedback with the loop closed does what the documentation says."""

import numpy as np
import pytest

from bench import feedback_loop


@pytest.mark.parametrize('lateness', feedback_loop.LATENESS)
def test_with_the_emulated_servo_all_cells_are_seen_again_and_again(monkeypatch, lateness):
    monkeypatch.setattr(feedback_loop, 'DURATION', 60.0)
    rounds = feedback_loop.rounds('feedback', 4001, lateness)
    assert len(rounds) >= 4
    assert max(rounds) < 14.0
    assert float(np.median(rounds)) < 9.0
