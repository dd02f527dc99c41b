"""With a servo by physics, a region is seen in the predicted time."""

import numpy as np

from bench.nod.scan_region import scanned


def test_the_predicted_time_holds_for_a_servo_by_physics():
    runs = [scanned('rx24f', 100, seed) for seed in range(100, 103)]
    assert all(success for _, _, success in runs)
    ratio = [taken / predicted for taken, predicted, _ in runs]
    assert 0.9 <= np.median(ratio) <= 1.1
