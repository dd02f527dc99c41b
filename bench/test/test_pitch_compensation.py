"""What limits that follow the range are good for, against two nods with fixed limits."""

from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

from bench.nod.pitch_compensation import ARMS, drive, DRIVES, of_finest_grid, repeats, variation

FRAMES = 120


@pytest.fixture(scope='module')
def arms():
    name, start, end = DRIVES[0]
    return [drive(load_scene(name), start, end, arm, frames=FRAMES) for arm in ARMS]


def test_compensated_limits_put_more_points_into_the_band_than_the_default_ones(arms):
    default, _, compensated = arms
    assert len(compensated.points) > 1.5 * len(default.points)


def test_they_are_more_even_and_repeat_less_than_limits_fixed_to_the_band(arms):
    _, fixed, compensated = arms
    assert len(compensated.points) > 0.95 * len(fixed.points)
    assert variation(compensated.points) < variation(fixed.points) / 2.0
    shares = [repeats(of_finest_grid(each.pitch)) for each in (compensated, fixed)]
    assert shares[0] < 0.85 * shares[1]


def test_the_controller_chooses_odd_n_s_as_the_span_changes(arms):
    *others, compensated = arms
    assert len(np.unique(compensated.samples_per_sweep)) > 1
    assert (compensated.samples_per_sweep % 2 == 1).all()
    assert all((other.samples_per_sweep == 4001).all() for other in others)
