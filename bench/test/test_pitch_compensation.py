"""Limits that follow the range save repeats and make points even over the height."""

from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

from bench.pitch_compensation import drive, DRIVES, N_S, repeats, variation

FRAMES = 600


def of_finest_grid(pitch, row):
    beams = np.broadcast_to(np.arange(pitch.shape[1]), pitch.shape)
    return repeats(np.stack([beams.ravel(), np.floor(pitch.ravel() / row)], axis=1))


@pytest.mark.parametrize(('name', 'start', 'end'), DRIVES)
def test_points_are_twice_as_even_and_repeat_less_with_compensated_limits(name, start, end):
    fixed, followed = (
        drive(load_scene(name, ideal=True), start, end, c, FRAMES) for c in (False, True)
    )
    assert variation(followed.points) <= variation(fixed.points) / 2.0
    row = np.ptp(fixed.pitch) / N_S
    ratio = of_finest_grid(followed.pitch, row) / of_finest_grid(fixed.pitch, row)
    assert ratio < (0.677 if name == 'wall' else 0.9)
