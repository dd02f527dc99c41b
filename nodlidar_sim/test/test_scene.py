from collections import Counter
from copy import deepcopy
from dataclasses import fields
from importlib import resources
import math
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.yaml_file import YamlError
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world import objects as objects_module
from nodlidar_sim.world.device_section import load_lidar, load_servo
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.route import Leg
from nodlidar_sim.world.scene import load_scene, parse_scene, route_names, scene_names
from nodlidar_sim.world.section import SceneError
from nodlidar_sim.world.world import World
import numpy as np
import pytest
import yaml

S = 1_000_000_000
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, 0)
WALL = 'objects: {wall: {shapes: [{plane: {point: [2, 0, 0], normal: [1, 0, 0]}}]}}\n'


def test_these_scenes_are_shipped():
    assert scene_names() == ['building', 'corner', 'corridor', 'crossing', 'room', 'wall']


@pytest.mark.parametrize('name', ['building', 'corner', 'corridor', 'crossing', 'room', 'wall'])
def test_a_shipped_scene_is_seen_by_the_sensor(name):
    scene = load_scene(name, ideal=True)
    assert scene.name == name
    recording = simulate(scene, NOD, 4.0)
    ahead = np.abs(recording.azimuth) < 0.3
    assert np.isfinite(recording.ranges[:, ahead]).all() or name in ('building', 'corridor')
    assert np.isfinite(recording.true_range[:, ahead]).all()
    assert recording.true_range.min() > 0.3


def test_in_the_room_every_beam_gets_an_answer():
    assert np.isfinite(simulate(load_scene('room', ideal=True), NOD, 4.0).ranges).all()


@pytest.mark.parametrize('name', scene_names())
def test_a_shipped_scene_names_real_devices_and_can_be_ideal(name):
    assert load_scene(name).lidar == load_lidar('urg_04lx_ug01')
    assert load_scene(name).servo == load_servo('rx24f')
    assert load_scene(name, ideal=True).lidar.ideal
    assert load_scene(name, ideal=True).servo is None


def test_everything_in_the_room_is_seen():
    recording = simulate(load_scene('room'), NOD, 10.0)
    scene = recording.world.scene
    azimuth = np.tile(recording.azimuth, len(recording.ranges))
    origins, directions = recording.world.rays(recording.true_time_ns.ravel(), azimuth)
    ends = origins + recording.true_range.reshape(-1, 1) * directions
    seen = {
        name: sum(int((shape.distance(ends.T) < 1e-6).sum()) for shape in shapes)
        for name, shapes in scene.objects.items()
    }
    assert set(seen) == {'walls', 'floor', 'ceiling', 'chair', 'manikin', 'robot'}
    assert min(seen.values()) > 300, seen


@pytest.mark.parametrize('name', ['building', 'corner', 'corridor', 'crossing', 'room', 'wall'])
def test_a_scene_makes_the_shapes_and_the_people_that_it_names_once(name, monkeypatch):
    made = Counter()
    counted = {
        kind: lambda *given, kind=kind, make=make: made.update([kind]) or make(*given)
        for kind, make in objects_module._MAKERS.items()
    }
    monkeypatch.setattr(objects_module, '_MAKERS', counted)
    scene = load_scene(name)
    file = resources.files('nodlidar_sim') / 'scenes' / f'{name}.yaml'
    objects = yaml.safe_load(file.read_text())['objects']
    assert made == Counter(kind for it in objects.values() for s in it['shapes'] for kind in s)
    assert list(scene.movers) == [name for name, it in objects.items() if 'motion' in it]


def test_an_unknown_scene_lists_the_known_ones():
    with pytest.raises(
        SceneError, match=r'one of building, corner, corridor, crossing, room, wall, or .*rooom'
    ):
        load_scene('rooom')


def test_these_routes_are_shipped():
    assert route_names() == ['approach', 'figure_of_eight', 'turn']


def route(name, scene='wall'):
    return load_scene(scene, name).route(0)


def test_the_approach_ends_in_front_of_the_wall():
    poses = route('approach').poses(np.array([0, 10 * S, 60 * S]))
    np.testing.assert_allclose(poses, [[-2.5, 0, 0], [0.5, 0, 0], [1.2, 0, 0]], atol=1e-8)


def test_the_figure_of_eight_closes_and_crosses_in_the_middle():
    lap = 8.0 * math.pi * S
    times = np.rint(lap * np.array([0.0, 0.25, 0.5, 0.75, 1.0, 7.0])).astype(np.int64)
    expected = [[0, 0], [0, 1.6], [0, 0], [0, -1.6], [0, 0], [0, 0]]
    np.testing.assert_allclose(route('figure_of_eight').poses(times)[:, :2], expected, atol=1e-7)


def test_the_turn_stays_in_place():
    poses = route('turn').poses(np.array([0, S, 100 * S]))
    np.testing.assert_array_equal(poses, [[0, 0, 0], [0, 0, 0.5], [0, 0, 50.0]])


def test_the_corridor_is_driven_there_and_back():
    half = 30.0 + 2.0 * math.pi
    times = np.rint(np.array([30.0, half, half + 30.0, 2.0 * half]) * S).astype(np.int64)
    poses = load_scene('corridor').route(0).poses(times)
    np.testing.assert_allclose(poses[:, 0], [9.0, 9.0, 0.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(poses[:, 1], 0.0, atol=1e-7)


def test_a_route_takes_the_place_of_the_base_of_a_scene(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('start: [1, 2, 3]')
    scene = load_scene('corridor', path)
    assert (scene.name, scene.base_start, scene.drives) == ('corridor', (1.0, 2.0, 3.0), False)


def test_an_unknown_route_lists_the_known_ones(tmp_path):
    with pytest.raises(
        SceneError, match=r"'route' must be one of approach, figure_of_eight, turn"
    ):
        load_scene('wall', 'circle')
    path = tmp_path / 'mine.yaml'
    path.write_text('speed: 1')
    with pytest.raises(SceneError, match=r'mine\.yaml: speed.* one of legs, repeat, start, velo'):
        load_scene('wall', path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(YamlError, match=r"mine\.yaml': No such file"):
        load_scene(tmp_path / 'mine.yaml')


def test_a_scene_of_the_user_is_loaded_by_its_path(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text(WALL)
    assert load_scene(path).name == load_scene(str(path)).name == 'mine'


def test_what_a_scene_leaves_out_has_its_default():
    scene = parse_scene(WALL, 'mine')
    np.testing.assert_array_equal(scene.mount.position, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(scene.mount.rotation, np.eye(3))
    assert scene.optical_offset == 0.08
    assert (scene.base_start, scene.base_velocity) == ((0.0, 0.0, 0.0), (0.0, 0.0))
    assert (scene.base_legs, scene.drives) == ((), False)
    assert scene.effects == Effects()


def test_every_key_of_a_scene_is_applied():
    scene = parse_scene(
        """
        sensor: {mount: [0.1, 0.2, 0.3, 0, 0, 1.5707963267948966], optical_offset: 0.05}
        base:
          start: [1, 2, 3]
          velocity: [0.4, -0.5]
          legs: [{duration: 2, velocity: [0.1, 0.2]}, {duration: 1.5, velocity: [0, 1]}]
        effects:
          {range_noise: 0.01, dropouts: 0.02, servo_jitter: 0.003, clock_drift: -40,
           odometry_error: 0.05, wheel_slip: 0.06, heading_drift: 0.07}
        objects:
          thing:
            pose: [1, 0, 0, 0, 0, 1.5707963267948966]
            shapes:
              - sphere: {center: [1, 0, 0], radius: 0.5}
              - box: {pose: [2, 0, 0, 0, 0, 0], size: [1, 2, 3]}
              - cylinder: {pose: [3, 0, 0, 0, 0, 0], radius: 0.1, length: 2}
              - plane: {point: [4, 0, 0], normal: [2, 0, 0]}
        """,
        'mine',
    )
    np.testing.assert_allclose(scene.mount.to_parent(np.eye(3)[:1]), [[0.1, 1.2, 0.3]])
    assert (scene.optical_offset, scene.base_start) == (0.05, (1.0, 2.0, 3.0))
    assert scene.base_velocity == (0.4, -0.5)
    assert scene.base_legs == (Leg(2.0, (0.1, 0.2)), Leg(1.5, (0.0, 1.0)))
    assert (scene.base_repeat, scene.drives) == (False, True)
    steady = scene.with_velocity((0.2, 0.1))
    assert (steady.base_velocity, steady.base_legs) == ((0.2, 0.1), ())
    assert not scene.with_velocity((0.0, 0.0)).drives
    assert scene.effects == Effects(0.01, 0.02, 0.003, -40.0, 0.05, 0.06, 0.07)
    sphere, box, cylinder, plane = scene.objects['thing']
    np.testing.assert_allclose(sphere.center, [1.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(box.center, [1.0, 2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(box.pose.rotation[:, 0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(cylinder.center, [1.0, 3.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(plane.point, [1.0, 4.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(plane.normal, [0.0, 1.0, 0.0], atol=1e-12)


def test_an_object_that_moves_is_apart_from_those_that_stand():
    scene = load_scene('crossing')
    assert (set(scene.objects), set(scene.movers)) == ({'wall', 'floor'}, {'person'})
    person = scene.movers['person'].plan.route(scene.movers['person'].start, 0)
    poses = person.poses(np.array([0, 2 * S, 4 * S, 5 * S, 7 * S, 10 * S]))
    np.testing.assert_allclose(poses[:, 0], 1.5, atol=1e-9)
    np.testing.assert_allclose(poses[:, 1], [-2.4, 0.0, 2.4, 2.4, 0.0, -2.4], atol=1e-9)


def with_shape(shape):
    return f'objects: {{it: {{shapes: [{shape}]}}}}'


@pytest.mark.parametrize(
    ('text', 'key', 'limit', 'value'),
    [
        ('- 1', 'm.yaml', 'a mapping of keys to values', [1]),
        ('', 'm.yaml', 'a mapping of keys to values', None),
        ('{}', 'm.yaml: objects', 'given', None),
        (
            WALL + 'wind: 3',
            'm.yaml: wind',
            'one of base, effects, ideal, lidar, objects, sensor, servo',
            'wind',
        ),
        (WALL + 'sensor: 3', 'm.yaml: sensor', 'a mapping of keys to values', 3),
        (
            WALL + 'sensor: {high: 3}',
            'm.yaml: sensor.high',
            'one of misalignment, mount',
            'high',
        ),
        (WALL + 'sensor: {mount: [1]}', 'm.yaml: sensor.mount', 'a list of 6 numbers', [1]),
        (WALL + 'sensor: {optical_offset: x}', 'm.yaml: sensor.optical_offset', 'a num', 'x'),
        (WALL + 'base: {start: [0, 0, .nan]}', 'm.yaml: base.start', '3 numbers', math.nan),
        (WALL + 'base: {velocity: [1, yes]}', 'm.yaml: base.velocity', 'of 2 num', [1, True]),
        (
            WALL.replace('shapes', 'motion: {speed: 1}, shapes'),
            'm.yaml: objects.wall.motion.speed',
            'one of legs, repeat, velocity',
            'speed',
        ),
        (WALL + 'base: {legs: []}', 'm.yaml: base.legs', 'at least one entry', []),
        (
            WALL + 'base: {legs: [{duration: 0, velocity: [1, 0]}]}',
            'm.yaml: base.legs[0].duration',
            'above 0 s',
            0.0,
        ),
        (WALL + 'base: {legs: [{duration: 1}]}', 'm.yaml: base.legs[0].velocity', 'given', None),
        (
            WALL + 'base: {legs: [{duration: 1, velocity: [0, 0], turn: 1}]}',
            'm.yaml: base.legs[0].turn',
            'one of duration, velocity',
            'turn',
        ),
        (WALL + 'base: {repeat: 1}', 'm.yaml: base.repeat', 'true or false', 1),
        (WALL + 'base: {repeat: true}', 'm.yaml: base.legs', 'given if they are to repeat', []),
        (WALL + 'effects: {fog: 1}', 'm.yaml: effects.fog', 'one of clock_drift, dro', 'fog'),
        (WALL + 'effects: {dropouts: 2}', 'm.yaml: effects.dropouts', 'between 0.0 and 1.0', 2.0),
        (WALL + 'effects: {dropouts: no}', 'm.yaml: effects.dropouts', 'a number', False),
        (WALL + 'effects: {servo_jitter: -1}', 'm.yaml: effects.servo_jitter', 'between', -1.0),
        ('objects: {it: {shapes: []}}', 'm.yaml: objects.it.shapes', 'at least one entry', []),
        ('objects: [1]', 'm.yaml: objects', 'a mapping of keys to values', [1]),
        ('objects: {1: {}}', 'm.yaml: objects.1.shapes', 'given', None),
        ('objects: {it: {colour: 1, shapes: [{}]}}', 'm.yaml: objects.it.shapes[0]', 'one of', ''),
        (with_shape('{cone: {}}'), 'm.yaml: objects.it.shapes[0]', 'plane, sphere', 'cone'),
        (
            with_shape('{sphere: {center: [0, 0, 0], radius: 0}}'),
            'm.yaml: objects.it.shapes[0].sphere.radius',
            'at least 1e-06 m',
            0.0,
        ),
        (
            with_shape('{box: {pose: [0, 0, 0, 0, 0, 0], size: [1, 0, 1]}}'),
            'm.yaml: objects.it.shapes[0].box.size',
            'at least 1e-06 m',
            [1.0, 0.0, 1.0],
        ),
        (
            with_shape('{plane: {point: [0, 0, 0], normal: [0, 0, 0]}}'),
            'm.yaml: objects.it.shapes[0].plane.normal',
            'at least 1e-06 long',
            [0.0, 0.0, 0.0],
        ),
        (
            with_shape('{cylinder: {pose: [0, 0, 0, 0, 0, 0], radius: 1, height: 1, length: 1}}'),
            'm.yaml: objects.it.shapes[0].cylinder.height',
            'one of length, pose, radius',
            'height',
        ),
        (
            WALL + 'sensor: {optical_offset: 1.0e+300}',
            'm.yaml: sensor.optical_offset',
            'to 1000',
            1e300,
        ),
        (WALL + f'base: {{start: [0, 0, {10**400}]}}', 'm.yaml: base.start', 'to 1000', None),
        (
            WALL + 'base: {legs: [{duration: 1.0e+9, velocity: [1, 0]}]}',
            'm.yaml: base.legs[0].duration',
            'to 86400',
            1e9,
        ),
        (WALL + WALL, 'm.yaml', r"'m.yaml', line \d: the key 'objects' comes twice", None),
        ('objects: [', 'm.yaml', r"'m.yaml', line 1: expected", None),
    ],
)
def test_what_is_wrong_in_a_scene_is_named(text, key, limit, value):
    with pytest.raises(ParameterError, match=limit) as error:
        parse_scene(text, 'm')
    assert error.value.key == key
    if value is not None and value is not math.nan:
        assert error.value.value == value


def test_a_scene_error_is_an_error_of_nodlidar():
    assert issubclass(SceneError, ParameterError)
    assert issubclass(SceneError, NodlidarError)


def test_every_effect_and_scene_is_in_the_readme():
    readme = (Path(__file__).parents[1] / 'README.md').read_text(encoding='utf-8')
    for name in [*(field.name for field in fields(Effects)), *scene_names(), *route_names()]:
        assert f'`{name}`' in readme


WEIRD = st.one_of(
    st.none(),
    st.booleans(),
    st.floats(),
    st.integers(-(10**400), 10**400),
    st.sampled_from(['', 'x', [], {}, [1e300] * 3, [1000.0] * 6, [1e-6] * 3, 1000.0, 86_400.0]),
)


def places(content):
    """Return every place in a YAML file's content, as a container and a key in it."""
    keys = content if isinstance(content, dict) else range(len(content))
    found = [(content, key) for key in keys]
    inner = [content[key] for key in keys if isinstance(content[key], (dict, list))]
    return found + [place for each in inner for place in places(each)]


@settings(max_examples=30)
@given(st.sampled_from(scene_names()), st.lists(st.tuples(st.integers(0), WEIRD), max_size=2))
def test_any_value_in_a_scene_is_one_of_a_world_or_a_typed_error(name, changes):
    file = resources.files('nodlidar_sim') / 'scenes' / f'{name}.yaml'
    content = yaml.safe_load(file.read_text())
    for where, value in changes:
        found = places(content)
        at, key = found[where % len(found)]
        at[key] = deepcopy(value)  # hypothesis gives the same list again
    try:
        scene = parse_scene(yaml.safe_dump(content), name)
    except ParameterError:
        return
    world = World(scene, IdealServo(), None, 0)
    with np.errstate(all='raise', under='ignore'):
        ranges = world.ranges(np.array([0, S, 10**15]), np.array([-1.0, 0.0, 1.0]))
    assert (ranges > 0.0).all()
