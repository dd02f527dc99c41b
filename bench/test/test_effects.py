"""What an effect of the simulator moves is told from what it does not: counts, never times."""

from dataclasses import fields, replace

from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.scene import load_scene
import numpy as np
import pytest

from bench.devices import effects
from bench.devices.effects import (
    ALL,
    Figures,
    LIDAR,
    moved,
    NONE,
    PEOPLE,
    recording,
    SCENES,
    SERVO,
    size_in_words,
    variants,
)
from bench.shared.report import recorded

NAMES = [field.name for field in fields(Effects)]


@pytest.fixture(scope='module', autouse=True)
def short():
    patch = pytest.MonkeyPatch()
    patch.setattr(effects, 'DURATION', 4.0)
    yield
    patch.undo()


def test_every_effect_is_tried_alone_and_with_all_others():
    found = variants(replace(load_scene('room', ideal=True), effects=Effects(range_noise=0.5)))
    assert list(found) == [NONE, *NAMES, LIDAR, SERVO, ALL]
    assert [name for name in found if not found[name].lidar.ideal] == [LIDAR]
    assert [name for name in found if found[name].servo is not None] == [SERVO]
    assert found[NONE].effects == Effects()
    for name in NAMES:
        on = [other for other in NAMES if getattr(found[name].effects, other) > 0.0]
        assert on == [name]
    assert all(getattr(found[ALL].effects, name) > 0.0 for name in NAMES)


def test_people_are_an_effect_where_a_scene_has_them():
    found = variants(load_scene('crossing', ideal=True))
    assert not found[NONE].movers
    assert not found['dropouts'].movers
    assert list(found[PEOPLE].movers) == list(found[ALL].movers) == ['person']


def test_a_figure_counts_beyond_its_threshold():
    bare = Figures(2.0, 1000.0, 0.001)
    assert moved(bare, bare) == ''
    assert moved(Figures(2.19, 991.0, 0.0109), bare) == ''
    assert moved(Figures(2.21, 989.0, 0.0111), bare) == 'RMS, points, repeats'
    assert moved(Figures(1.7, 1011.0, 0.0), bare) == 'RMS, points'


def test_the_rows_of_a_scene_compare_each_effect_with_none(monkeypatch):
    """All effects but those of sets take less than the ray casts of the room: a ratio in a run."""
    monkeypatch.setattr(effects, 'SEEDS', range(1))
    rows = effects.scene_rows(load_scene('room', ideal=True), rounds=5)
    assert [row['effect'] for row in rows] == [NONE, *NAMES, LIDAR, SERVO, ALL]
    assert (rows[0]['to that of none'], rows[0]['points lost [%]']) == (1.0, 0.0)
    assert all(row['to that of none'] < 2.0 for row in rows if row['effect'] not in (LIDAR, SERVO))


def test_sizes_have_their_units():
    assert size_in_words('range_noise') == '0.01 m'
    assert size_in_words('dropouts') == '0.02'
    assert size_in_words(NONE) == size_in_words(PEOPLE) == ''


@pytest.mark.parametrize(
    ('scene', 'effect', 'expected'),
    [
        ('wall', 'range_noise', 'RMS'),
        ('wall', 'dropouts', 'points'),
        ('room', LIDAR, 'RMS'),
        ('wall', 'odometry_error', ''),
        ('wall', 'heading_drift', ''),
        ('corridor', 'odometry_error', 'RMS'),
        ('crossing', PEOPLE, 'RMS'),
    ],
)
def test_what_a_scene_requires_is_found(scene, effect, expected):
    """Odometry matters to a robot that drives, and a person to a map."""
    found = variants(load_scene(scene, ideal=True))
    bare, spoilt = (effects.figures(recording(found[name])) for name in (NONE, effect))
    assert moved(spoilt, bare) == expected


def test_a_beam_repeats_one_in_its_row_of_the_same_step(monkeypatch):
    """The coprime nod never does, but for rounding; with one row for a degree, nearly all do."""
    simulated = recording(load_scene('wall', ideal=True))
    assert effects.repeats(simulated) < 5e-4
    monkeypatch.setattr(effects, 'REFERENCE_N_S', 70)
    rows = 2 * effects.LINEAR / effects.SPAN * 70 + 2
    beams = (np.abs(simulated.true_pitch) < effects.LINEAR).sum()
    assert effects.repeats(simulated) >= 1.0 - rows * 682 / beams


def test_the_documentation_says_what_was_found():
    """In docs/physics.md, under 'Which effects a scene needs'."""
    required = {
        (row['scene'], row['effect']): row['required for']
        for row in recorded('effects')['rows']
        if row['required for'] and row['effect'] != ALL
    }
    everywhere = {
        'range_noise': 'RMS',
        'dropouts': 'points',
        'servo_jitter': 'repeats',
        'clock_drift': 'repeats',
    }
    expected = {(name, effect): f for name in SCENES for effect, f in everywhere.items()}
    wheels = ('odometry_error', 'wheel_slip', 'heading_drift')
    expected |= {('corridor', effect): 'RMS' for effect in wheels}
    expected |= {(name, LIDAR): 'RMS, points' for name in SCENES} | {('room', LIDAR): 'RMS'}
    expected |= {(name, SERVO): 'RMS, repeats' for name in SCENES}
    expected |= {('crossing', PEOPLE): 'RMS', ('crossing', SERVO): 'RMS, points, repeats'}
    assert required == expected
