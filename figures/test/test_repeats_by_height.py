"""Repeats over the height of the nod."""

import numpy as np

from figures.repeats_by_height import counts_by_height


def test_a_nod_that_reverses_at_once_and_on_time_has_no_repeats():
    beams, repeats = counts_by_height(1001, reversal_error=0.0, acceleration=1e9)
    assert beams.sum() == 1001 * 1024
    assert repeats.sum() == 0


def test_repeats_pile_up_at_the_reversals():
    beams, repeats = counts_by_height(3009, reversal_error=0.0)
    share = repeats / np.maximum(beams, 1)
    assert share[10:90].max() < 0.01
    assert share[:10].max() > 0.5
    assert share[90:].max() > 0.5
