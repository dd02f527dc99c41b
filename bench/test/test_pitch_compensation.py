"""Limits that follow the range save repeats and make points even over the height."""

from nodlidar_sim.scene import load_scene
import numpy as np
import pytest

from bench.pitch_compensation import BINS, CUBES, drive, DRIVES


def repeats(points):
    cubes = np.unique(np.floor(points / CUBES[0]).astype(int), axis=0)
    return len(points) - len(cubes)


def variation(points):
    counts, _ = np.histogram(points[:, 2], bins=BINS)
    return counts.std() / counts.mean()


@pytest.mark.parametrize(('name', 'start', 'end'), DRIVES)
def test_points_are_twice_as_even_and_repeat_less_with_compensated_limits(name, start, end):
    fixed, compensated = (drive(load_scene(name), start, end, c) for c in (False, True))
    assert variation(compensated) <= variation(fixed) / 2.0
    assert repeats(compensated) < repeats(fixed) * (0.677 if name == 'wall' else 1.0)
