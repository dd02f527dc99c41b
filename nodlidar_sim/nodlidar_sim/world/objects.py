"""Reads the objects and the motions of a scene."""

from __future__ import annotations

from nodlidar_common.pose import Pose
from nodlidar_sim.world.moving import Mover
from nodlidar_sim.world.raycast import PLAIN
from nodlidar_sim.world.route import Leg, Plan, STANDING, Velocity
from nodlidar_sim.world.section import Section
from nodlidar_sim.world.shapes import Box, Cylinder, Plane, Shape, Sphere
import numpy as np

POSE = 'x y z roll pitch yaw'
_LONGEST_LEG = 86_400.0  # s


def read_plan(section: Section) -> Plan:
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


def read_object(section: Section) -> tuple[tuple[Shape, ...] | Mover, float]:
    """Return the shapes of an object in the world, or a moving object; and its brightness."""
    brightness = section.number('brightness', PLAIN)
    if not 0.0 <= brightness <= 1.0:
        raise section.error('brightness', 'a number from 0 to 1', brightness)
    x, y, z, roll, pitch, yaw = section.vector('pose', POSE, (0.0,) * 6)
    if not section.has('motion'):
        return _shapes(section, Pose.from_xyzrpy((x, y, z, roll, pitch, yaw))), brightness
    motion = section.section('motion')
    plan = read_plan(motion)
    motion.close()
    shapes = _shapes(section, Pose.from_xyzrpy((0.0, 0.0, z, roll, pitch, 0.0)))
    return Mover(shapes, (x, y, yaw), plan, brightness), brightness


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
    pose = Pose.from_xyzrpy(parts.vector('pose', POSE))
    return Box(parent @ pose, np.array(parts.vector('size', 'x y z')))


def _cylinder(parts: Section, parent: Pose) -> Shape:
    pose = Pose.from_xyzrpy(parts.vector('pose', POSE))
    return Cylinder(parent @ pose, parts.number('radius'), parts.number('length'))


_MAKERS = {'plane': _plane, 'sphere': _sphere, 'box': _box, 'cylinder': _cylinder}
