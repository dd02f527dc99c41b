"""Scenes: objects, the sensor's mount, the motion of the base, and effects."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from nodlidar_common.pose import Pose
from nodlidar_common.yaml_file import parse_yaml
from nodlidar_sim.world import shipped
from nodlidar_sim.world.device_section import lidar_parameters, servo_parameters
from nodlidar_sim.world.effects import Effects
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.moving import Mover
from nodlidar_sim.world.objects import POSE, read_object, read_plan
from nodlidar_sim.world.raycast import Surfaces, surfaces_of
from nodlidar_sim.world.route import Leg, Plan, Route, Velocity
from nodlidar_sim.world.section import SceneError, Section
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.shapes import Shape


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
    misalignment
        Pose of the lidar off that place: x y z [m], roll pitch yaw [rad].
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
    lidar
        Errors of the lidar, by default none.
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
    lidar: LidarParameters = field(default_factory=LidarParameters)
    misalignment: tuple[float, ...] = (0.0,) * 6

    @property
    def laser(self) -> Pose:
        """Lidar in the nodding frame."""
        x, y, z, *rpy = self.misalignment
        return Pose.from_xyzrpy((x, y, z + self.optical_offset, *rpy))

    @property
    def drives(self) -> bool:
        """Whether the base ever moves."""
        return self._base_plan.drives

    @property
    def moves(self) -> bool:
        """Whether the base or an object ever moves."""
        return self.drives or bool(self.movers)

    def ideal(self) -> Scene:
        """Return the scene without errors of devices and odometry."""
        return replace(self, effects=Effects(), lidar=LidarParameters(), servo=None)

    def with_velocity(self, velocity: Velocity) -> Scene:
        """Return the scene with a base of constant velocity, 0 for none, in place of its own."""
        return replace(self, base_velocity=velocity, base_legs=(), base_repeat=False)

    def route(self, start_ns: int) -> Route:
        """Return the route of the base, for a start at a time [ns]."""
        return self._base_plan.route(self.base_start, start_ns)

    @property
    def _base_plan(self) -> Plan:
        return Plan(self.base_velocity, self.base_legs, self.base_repeat)


def scene_names() -> list[str]:
    """Return the names of the package's scenes."""
    return shipped.names('scenes')


def route_names() -> list[str]:
    """Return the names of the package's routes."""
    return shipped.names('routes')


def load_scene(
    name_or_path: str | Path, route: str | Path | None = None, *, ideal: bool = False
) -> Scene:
    """Load a scene of the package by name, or another one by the path of its YAML file.

    A route, also by name or path, replaces the scene's `base`. `ideal`, here or in the file,
    switches all errors of devices and odometry off.

    Raises
    ------
    SceneError
        If the scene or route does not exist, or is not as specified in the README.
    YamlError
        If its file cannot be read, or is no YAML.
    """
    root = _load(name_or_path, 'scene')
    base = root.section('base', {})
    scene = _scene(root, base if route is None else _load(route, 'route'))
    return scene.ideal() if ideal else scene


def parse_scene(text: str, name: str) -> Scene:
    """Return the scene of a YAML text; raises as `load_scene`."""
    root = Section(parse_yaml(text, f'{name}.yaml'), f'{name}.yaml')
    return _scene(root, root.section('base', {}))


def _load(name_or_path: str | Path, kind: str) -> Section:
    """Return the content of a file of a kind, 'scene' or 'route', by name or path."""
    folder = f'{kind}s'
    found = shipped.find(folder, name_or_path)
    if found is None:
        raise SceneError(kind, shipped.allowed(folder), str(name_or_path))
    return found


def _scene(root: Section, base: Section) -> Scene:
    """Return the scene of a file, with a base that may be of another file."""
    section = root.section('objects')
    found = {name: read_object(section.section(name)) for name in section.names()}
    at_rest = {
        name: (thing, brightness)
        for name, (thing, brightness) in found.items()
        if not isinstance(thing, Mover)
    }
    sensor = root.section('sensor', {})
    x, y, yaw = base.vector('start', 'x y yaw', (0.0, 0.0, 0.0))
    plan = read_plan(base)
    scene = Scene(
        name=root.name,
        objects={name: shapes for name, (shapes, _) in at_rest.items()},
        surfaces=surfaces_of(
            [shape for shapes, _ in at_rest.values() for shape in shapes],
            [brightness for shapes, brightness in at_rest.values() for _ in shapes],
        ),
        mount=Pose.from_xyzrpy(sensor.vector('mount', POSE, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))),
        optical_offset=sensor.number('optical_offset', 0.08),
        misalignment=tuple(sensor.vector('misalignment', POSE, (0.0,) * 6)),
        base_start=(x, y, yaw),
        base_velocity=plan.velocity,
        effects=_effects(root.section('effects', {})),
        base_legs=plan.legs,
        base_repeat=plan.repeat,
        movers={name: thing for name, (thing, _) in found.items() if isinstance(thing, Mover)},
        servo=servo_parameters(root),
        lidar=lidar_parameters(root) or LidarParameters(),
    )
    if scene.servo is not None and scene.effects.servo_jitter > 0.0:
        limit = '0 with a servo by physics, which has its own'
        raise root.error('effects.servo_jitter', limit, scene.effects.servo_jitter)
    ideal = root.truth('ideal', False)
    for section in (root, sensor, base):
        section.close()
    return scene.ideal() if ideal else scene


def _effects(section: Section) -> Effects:
    values = {f.name: section.number(f.name, 0.0) for f in fields(Effects)}
    section.close()
    with section.locating():
        return Effects(**values)
