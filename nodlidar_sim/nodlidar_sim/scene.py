"""Scenes: what surrounds the sensor, how it is mounted, how its base moves and what goes wrong."""

from __future__ import annotations

from dataclasses import dataclass, fields
from importlib import resources
from pathlib import Path

from nodlidar_common.parameters import check
from nodlidar_common.pose import Pose
from nodlidar_sim.base import ConstantTwist
from nodlidar_sim.effects import Effects
from nodlidar_sim.raycast import Surfaces, surfaces_of
from nodlidar_sim.section import SceneError, Section
from nodlidar_sim.shapes import Box, Cylinder, Plane, Shape, Sphere
import numpy as np
import yaml

_POSE = 'x y z roll pitch yaw'
_SUFFIX = '.yaml'


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A scene, ready for rays.

    Attributes
    ----------
    name
        Of the file, without its suffix.
    objects
        The shapes of every named object, in the world.
    surfaces
        All of them, for rays and distances.
    mount
        nodlidar_base_link in base_link.
    optical_offset
        z_off: the optical centre above the nod axis, in the nodding frame [m].
    base_start, base_velocity
        x [m], y [m], yaw [rad] of base_link in the world at first, and its constant forward
        speed [m/s] and turn rate [rad/s].
    effects
        What goes wrong.
    """

    name: str
    objects: dict[str, tuple[Shape, ...]]
    surfaces: Surfaces
    mount: Pose
    optical_offset: float
    base_start: tuple[float, float, float]
    base_velocity: tuple[float, float]
    effects: Effects

    def route(self, start_ns: int) -> ConstantTwist:
        """Return the motion of the base when it leaves the start at start_ns."""
        return ConstantTwist(self.base_start, self.base_velocity, start_ns)


def scene_names() -> list[str]:
    """Return the names of the scenes that come with this package."""
    files = resources.files('nodlidar_sim').joinpath('scenes').iterdir()
    return sorted(Path(f.name).stem for f in files if f.name.endswith(_SUFFIX))


def load_scene(name_or_path: str | Path) -> Scene:
    """Load a scene that comes with this package, by name, or any other, by the path of its YAML.

    Raises
    ------
    SceneError
        If there is no such scene or file, or it is not as the README says.
    """
    if str(name_or_path) in scene_names():
        shipped = resources.files('nodlidar_sim').joinpath('scenes') / f'{name_or_path}{_SUFFIX}'
        return parse_scene(shipped.read_text(encoding='utf-8'), str(name_or_path))
    path = Path(name_or_path)
    if path.suffix != _SUFFIX:
        known = ', '.join(scene_names())
        raise SceneError('scene', f'one of {known}, or a path that ends in {_SUFFIX}', str(path))
    try:
        return parse_scene(path.read_text(encoding='utf-8'), path.stem)
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError('scene', f'a readable file ({error})', str(path)) from error


def parse_scene(text: str, name: str) -> Scene:
    """Return the scene of a YAML text; raises SceneError as load_scene does."""
    file = name + _SUFFIX
    try:
        root = Section(yaml.load(text, _UniqueKeyLoader), file)
    except yaml.YAMLError as error:
        raise SceneError(file, 'YAML with unique keys', str(error)) from error
    objects = _objects(root.section('objects'))
    sensor, base = root.section('sensor', {}), root.section('base', {})
    x, y, yaw = base.vector('start', 'x y yaw', (0.0, 0.0, 0.0))
    speed, rate = base.vector('velocity', 'forward turn', (0.0, 0.0))
    scene = Scene(
        name=name,
        objects=objects,
        surfaces=surfaces_of([shape for shapes in objects.values() for shape in shapes]),
        mount=Pose.from_xyzrpy(sensor.vector('mount', _POSE, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))),
        optical_offset=sensor.number('optical_offset', 0.08),
        base_start=(x, y, yaw),
        base_velocity=(speed, rate),
        effects=_effects(root.section('effects', {})),
    )
    for section in (root, sensor, base):
        section.close()
    return scene


def _effects(section: Section) -> Effects:
    values = {f.name: section.number(f.name, 0.0) for f in fields(Effects)}
    section.close()
    effects = Effects(**values)
    with section.locating():
        check(effects)
    return effects


def _objects(section: Section) -> dict[str, tuple[Shape, ...]]:
    return {name: _object(section.section(name)) for name in section.names()}


def _object(section: Section) -> tuple[Shape, ...]:
    pose = Pose.from_xyzrpy(section.vector('pose', _POSE, (0.0,) * 6))
    shapes = tuple(_shape(entry, pose) for entry in section.sections('shapes'))
    section.close()
    return shapes


def _shape(section: Section, parent: Pose) -> Shape:
    """Return the shape of an entry like `box: {pose: ..., size: ...}`."""
    kinds = section.names()
    if len(kinds) != 1 or kinds[0] not in _MAKERS:
        raise section.error(None, 'one of ' + ', '.join(_MAKERS), ', '.join(kinds))
    parts = section.section(kinds[0])
    with parts.locating():
        shape = _MAKERS[kinds[0]](parts, parent)
    parts.close()
    return shape


def _plane(parts: Section, parent: Pose) -> Shape:
    point = np.array([parts.vector('point', 'x y z')])
    normal = np.array([parts.vector('normal', 'x y z')])
    return Plane(parent.to_parent(point)[0], parent.directions_to_parent(normal)[0])


def _sphere(parts: Section, parent: Pose) -> Shape:
    center = np.array([parts.vector('center', 'x y z')])
    return Sphere(parent.to_parent(center)[0], parts.number('radius'))


def _box(parts: Section, parent: Pose) -> Shape:
    pose = Pose.from_xyzrpy(parts.vector('pose', _POSE))
    return Box(parent @ pose, np.array(parts.vector('size', 'x y z')))


def _cylinder(parts: Section, parent: Pose) -> Shape:
    pose = Pose.from_xyzrpy(parts.vector('pose', _POSE))
    return Cylinder(parent @ pose, parts.number('radius'), parts.number('length'))


_MAKERS = {'plane': _plane, 'sphere': _sphere, 'box': _box, 'cylinder': _cylinder}


class _UniqueKeyLoader(yaml.SafeLoader):
    """Refuses a key that a mapping has twice, of which YAML would take the last in silence."""

    def construct_mapping(
        self, node: yaml.MappingNode, deep: bool = False
    ) -> dict[object, object]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(
                    None, None, f'the key {key!r} comes twice', node.start_mark
                )
        return dict(super().construct_mapping(node, deep))
