"""Scenes: objects, the sensor's mount, the motion of the base, and effects."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from importlib import resources
from pathlib import Path

from nodlidar_common.parameters import check
from nodlidar_common.pose import Pose
from nodlidar_common.yaml_file import parse_yaml, read_yaml
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.moving import Mover
from nodlidar_sim.world.raycast import Surfaces, surfaces_of
from nodlidar_sim.world.route import Leg, Plan, Route, STANDING, Velocity
from nodlidar_sim.world.section import SceneError, Section
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo_section import servo_parameters
from nodlidar_sim.world.shapes import Box, Cylinder, Plane, Shape, Sphere
import numpy as np

_POSE = 'x y z roll pitch yaw'
_SUFFIX = '.yaml'
_LONGEST_LEG = 86_400.0  # s


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A scene.

    Attributes
    ----------
    name
        Of the file, without its suffix.
    objects
        The shapes in the world of every object at rest, by name.
    surfaces
        All of these shapes.
    mount
        nodlidar_base_link in base_link.
    optical_offset
        z_off: height of the optical centre above the nod axis, in the nodding frame [m].
    base_start, base_velocity
        Initial x [m], y [m], yaw [rad] of base_link in the world; its forward speed [m/s] and turn
        rate [rad/s] after the legs.
    effects
        Error sources.
    base_legs, base_repeat
        Legs that the base drives first, and whether it repeats them: see route.Plan.
    movers
        Every moving object, by name.
    servo
        Parameters of a servo by physics; None for an ideal one.
    """

    name: str
    objects: dict[str, tuple[Shape, ...]]
    surfaces: Surfaces
    mount: Pose
    optical_offset: float
    base_start: tuple[float, float, float]
    base_velocity: Velocity
    effects: Effects
    base_legs: tuple[Leg, ...] = ()
    base_repeat: bool = False
    movers: dict[str, Mover] = field(default_factory=dict)
    servo: ServoParameters | None = None

    @property
    def drives(self) -> bool:
        """Whether the base ever moves."""
        return self._base_plan.drives

    @property
    def moves(self) -> bool:
        """Whether the base or an object ever moves."""
        return self.drives or bool(self.movers)

    def route(self, start_ns: int) -> Route:
        """Return the route of the base, for a start at a time [ns]."""
        return self._base_plan.route(self.base_start, start_ns)

    @property
    def _base_plan(self) -> Plan:
        return Plan(self.base_velocity, self.base_legs, self.base_repeat)


def scene_names() -> list[str]:
    """Return the names of the package's scenes."""
    return _shipped('scenes')


def route_names() -> list[str]:
    """Return the names of the package's routes."""
    return _shipped('routes')


def load_scene(name_or_path: str | Path, route: str | Path | None = None) -> Scene:
    """Load a scene of the package by name, or another one by the path of its YAML file.

    A route, also by name or path, replaces the scene's `base`.

    Raises
    ------
    SceneError
        If the scene or route does not exist, or is not as specified in the README.
    YamlError
        If its file cannot be read, or is no YAML.
    """
    root = _load(name_or_path, 'scene')
    base = root.section('base', {})
    return _scene(root, base if route is None else _load(route, 'route'))


def parse_scene(text: str, name: str) -> Scene:
    """Return the scene of a YAML text; raises as `load_scene`."""
    root = _parse(text, name)
    return _scene(root, root.section('base', {}))


def _shipped(kind: str) -> list[str]:
    files = resources.files('nodlidar_sim').joinpath(kind).iterdir()
    return sorted(Path(f.name).stem for f in files if f.name.endswith(_SUFFIX))


def _load(name_or_path: str | Path, kind: str) -> Section:
    """Return the content of a file of a kind, 'scene' or 'route', by name or path."""
    names = _shipped(f'{kind}s')
    if str(name_or_path) in names:
        shipped = resources.files('nodlidar_sim').joinpath(f'{kind}s') / f'{name_or_path}{_SUFFIX}'
        return _parse(shipped.read_text(encoding='utf-8'), str(name_or_path))
    path = Path(name_or_path)
    if path.suffix != _SUFFIX:
        limit = f'one of {", ".join(names)}, or a path that ends in {_SUFFIX}'
        raise SceneError(kind, limit, str(path))
    return Section(read_yaml(path), path.name)


def _parse(text: str, name: str) -> Section:
    return Section(parse_yaml(text, name + _SUFFIX), name + _SUFFIX)


def _scene(root: Section, base: Section) -> Scene:
    """Return the scene of a file, with a base that may be of another file."""
    section = root.section('objects')
    found = {name: _object(section.section(name)) for name in section.names()}
    objects = {name: thing for name, thing in found.items() if not isinstance(thing, Mover)}
    sensor = root.section('sensor', {})
    x, y, yaw = base.vector('start', 'x y yaw', (0.0, 0.0, 0.0))
    plan = _plan(base)
    scene = Scene(
        name=root.name,
        objects=objects,
        surfaces=surfaces_of([shape for shapes in objects.values() for shape in shapes]),
        mount=Pose.from_xyzrpy(sensor.vector('mount', _POSE, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))),
        optical_offset=sensor.number('optical_offset', 0.08),
        base_start=(x, y, yaw),
        base_velocity=plan.velocity,
        effects=_effects(root.section('effects', {})),
        base_legs=plan.legs,
        base_repeat=plan.repeat,
        movers={name: thing for name, thing in found.items() if isinstance(thing, Mover)},
        servo=servo_parameters(root),
    )
    for section in (root, sensor, base):
        section.close()
    return scene


def _plan(section: Section) -> Plan:
    """Return the plan of the keys `velocity`, `legs` and `repeat`."""
    legs = tuple(_leg(entry) for entry in section.sections('legs', []))
    with section.locating():
        return Plan(_velocity(section, STANDING), legs, section.truth('repeat', False))


def _leg(section: Section) -> Leg:
    with section.locating():
        leg = Leg(section.number('duration', most=_LONGEST_LEG), _velocity(section))
    section.close()
    return leg


def _velocity(section: Section, *default: Velocity) -> Velocity:
    speed, rate = section.vector('velocity', 'forward turn', *default)
    return speed, rate


def _effects(section: Section) -> Effects:
    values = {f.name: section.number(f.name, 0.0) for f in fields(Effects)}
    section.close()
    effects = Effects(**values)
    with section.locating():
        check(effects)
    return effects


def _object(section: Section) -> tuple[Shape, ...] | Mover:
    """Return the shapes of an object in the world, or a moving object."""
    x, y, z, roll, pitch, yaw = section.vector('pose', _POSE, (0.0,) * 6)
    if not section.has('motion'):
        return _shapes(section, Pose.from_xyzrpy((x, y, z, roll, pitch, yaw)))
    motion = section.section('motion')
    plan = _plan(motion)
    motion.close()
    shapes = _shapes(section, Pose.from_xyzrpy((0.0, 0.0, z, roll, pitch, 0.0)))
    return Mover(shapes, (x, y, yaw), plan)


def _shapes(section: Section, parent: Pose) -> tuple[Shape, ...]:
    shapes = tuple(_shape(entry, parent) for entry in section.sections('shapes'))
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
