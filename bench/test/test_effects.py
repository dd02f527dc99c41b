"""What an effect of the simulator moves is told from what it does not: counts, never times."""

from dataclasses import fields, replace
import math

from nodlidar_sim.effects import Effects
from nodlidar_sim.scene import load_scene
import pytest

from bench import effects
from bench.effects import ALL, Figures, moved, NONE, PEOPLE, recording, size_in_words, variants

NAMES = [field.name for field in fields(Effects)]


@pytest.fixture(scope='module', autouse=True)
def short():
    patch = pytest.MonkeyPatch()
    patch.setattr(effects, 'DURATION', 4.0)
    yield
    patch.undo()


def test_every_effect_is_tried_alone_and_with_all_others():
    found = variants(replace(load_scene('room'), effects=Effects(range_noise=0.5)))
    assert list(found) == [NONE, *NAMES, ALL]
    assert found[NONE].effects == Effects()
    for name in NAMES:
        on = [other for other in NAMES if getattr(found[name].effects, other) > 0.0]
        assert on == [name]
    assert all(getattr(found[ALL].effects, name) > 0.0 for name in NAMES)


def test_people_are_an_effect_where_a_scene_has_them():
    found = variants(load_scene('crossing'))
    assert not found[NONE].movers
    assert not found['dropouts'].movers
    assert list(found[PEOPLE].movers) == list(found[ALL].movers) == ['person']


def test_a_figure_counts_beyond_its_threshold():
    bare = Figures(2.0, 1000.0, 10.0)
    assert moved(bare, bare) == ''
    assert moved(Figures(2.19, 991.0, 10.9), bare) == ''
    assert moved(Figures(2.21, 989.0, 11.1), bare) == 'RMS, points, completion'
    assert moved(Figures(1.7, 1011.0, math.inf), bare) == 'RMS, points, completion'


def test_sizes_have_their_units():
    assert size_in_words('range_noise') == '0.01 m'
    assert size_in_words('dropouts') == '0.02'
    assert size_in_words(NONE) == size_in_words(PEOPLE) == ''


@pytest.mark.parametrize(
    ('scene', 'effect', 'expected'),
    [
        ('wall', 'range_noise', 'RMS'),
        ('wall', 'dropouts', 'points'),
        ('wall', 'odometry_error', ''),
        ('wall', 'clock_drift', ''),
        ('corridor', 'odometry_error', 'RMS'),
        ('crossing', PEOPLE, 'RMS'),
    ],
)
def test_what_a_scene_requires_is_found(scene, effect, expected):
    """Odometry matters to a robot that drives, and a person to a map."""
    found = variants(load_scene(scene))
    bare, spoilt = (effects.figures(recording(found[name])) for name in (NONE, effect))
    assert moved(replace(spoilt, completion=1.0), replace(bare, completion=1.0)) == expected


def test_completion_is_when_the_last_cell_is_hit(monkeypatch):
    """One cell that is the whole region is hit by the first beam in it; so small ones, never."""
    simulated = recording(load_scene('wall'))
    monkeypatch.setattr(effects, 'CELLS', effects.Task(8.0, 4.0, -0.6, 0.6, azimuth=0.5))
    inside = (abs(simulated.true_pitch) < 0.6) & (abs(simulated.azimuth) < 0.5)
    first_ns = simulated.true_time_ns[inside].min()
    assert effects.completion(simulated) == pytest.approx((first_ns - effects.START_NS) / 1e9)
    monkeypatch.setattr(effects, 'CELLS', effects.Task(0.01, 2.0, -0.58, 0.58))
    assert effects.completion(simulated) == math.inf
