"""The joints of a URDF and the transforms that their positions make; no ROS in here."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
import math
from typing import Any

from transforms3d.euler import euler2quat
from transforms3d.quaternions import axangle2quat, qmult, rotate_vector
from urdf_parser_py import urdf

Vector = Sequence[float]
_MOVING = ('revolute', 'continuous', 'prismatic')


class UrdfError(ValueError):
    """A robot description that is not a URDF of one tree; says what is wrong with it."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint and where its child is in its parent.

    Attributes
    ----------
    name, kind, parent, child
        As in the URDF; kind is its type.
    translation, rotation
        Pose of the joint [m] and quaternion (w, x, y, z).
    axis
        Direction of motion in the joint's frame, of length 1.
    """

    name: str
    kind: str
    parent: str
    child: str
    translation: Vector
    rotation: Vector
    axis: Vector

    def pose(self, position: float) -> tuple[Vector, Vector]:
        """Return translation and quaternion (w, x, y, z) of the child at a position [rad or m]."""
        if self.kind in ('revolute', 'continuous'):
            turn = axangle2quat(self.axis, position, is_normalized=True)
            return self.translation, qmult(self.rotation, turn)
        if self.kind == 'prismatic':
            way = rotate_vector([position * a for a in self.axis], self.rotation)
            return [t + w for t, w in zip(self.translation, way, strict=True)], self.rotation
        return self.translation, self.rotation


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint that follows another one: position = multiplier * position of it + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(slots=True)
class Robot:
    """A robot's joints by name; floating ones, which have no position, are left out."""

    fixed: dict[str, Joint] = field(default_factory=dict)
    moving: dict[str, Joint] = field(default_factory=dict)
    mimics: dict[str, Mimic] = field(default_factory=dict)

    def moved(self, names: Sequence[str], positions: Sequence[float]) -> Iterator[Any]:
        """Yield (joint, position) for the moving joints among the given and those that mimic them.

        A position that is given counts more than a mimicked one, the first of several of a name
        more than the others.
        """
        known: dict[str, float] = {}
        for name, position in zip(names, positions, strict=True):
            known.setdefault(name, position)
        for name, mimic in sorted(self.mimics.items()):
            if mimic.joint in known:
                known.setdefault(name, known[mimic.joint] * mimic.multiplier + mimic.offset)
        for name, position in sorted(known.items()):
            if name in self.moving:
                yield self.moving[name], position


def parse(description: str) -> Robot:
    """Read a URDF.

    Raises
    ------
    UrdfError
        If it is empty, no URDF, not one tree of links, or a joint lacks what its type needs.
    """
    if not description:
        raise UrdfError('robot_description parameter must not be empty')
    try:
        model = urdf.Robot.from_xml_string(description.encode())
    except Exception as error:  # the parser raises whatever comes up
        raise UrdfError(f'robot_description is not a URDF: {error}') from error
    _check_tree([link.name for link in model.links], model.joints)
    return _robot(model.joints)


def _robot(urdf_joints: Any) -> Robot:
    robot = Robot()
    for urdf_joint in urdf_joints:
        joint = _joint(urdf_joint)
        if joint.kind in _MOVING:
            robot.moving[joint.name] = joint
        elif joint.kind != 'floating':
            robot.fixed[joint.name] = joint
        if urdf_joint.mimic is not None:
            robot.mimics[joint.name] = _mimic(urdf_joint.mimic)
    return robot


def _joint(urdf_joint: Any) -> Joint:
    name, kind, origin = urdf_joint.name, urdf_joint.type, urdf_joint.origin
    if kind in ('revolute', 'prismatic') and urdf_joint.limit is None:
        raise UrdfError(f"joint '{name}' is of type {kind} but has no limit")
    axis = urdf_joint.axis or (1.0, 0.0, 0.0)
    if kind in _MOVING and not any(axis):
        raise UrdfError(f"joint '{name}' has an axis of no direction: {axis}")
    xyz = (origin and origin.xyz) or (0.0, 0.0, 0.0)
    rpy = (origin and origin.rpy) or (0.0, 0.0, 0.0)
    length = math.hypot(*axis)
    return Joint(
        name=name,
        kind=kind,
        parent=urdf_joint.parent,
        child=urdf_joint.child,
        translation=xyz,
        rotation=euler2quat(*rpy, 'sxyz'),
        axis=[a / length for a in axis] if length else axis,
    )


def _mimic(urdf_mimic: Any) -> Mimic:
    multiplier = 1.0 if urdf_mimic.multiplier is None else urdf_mimic.multiplier
    return Mimic(urdf_mimic.joint, multiplier, urdf_mimic.offset or 0.0)


def _check_tree(links: list[str], joints: Any) -> None:
    """Check that the joints connect all of the links to one root."""
    _check_unique('link', links)
    _check_unique('joint', [joint.name for joint in joints])
    _check_unique('child link', [joint.child for joint in joints])
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise UrdfError(f"joint '{joint.name}' is of link '{link}', which does not exist")
    roots = set(links) - {joint.child for joint in joints}
    if len(roots) != 1:
        raise UrdfError(f'there must be one root link, but there are {sorted(roots) or "none"}')
    _check_reached(links, roots, joints)


def _check_reached(links: list[str], reached: set[str], joints: Any) -> None:
    """Check that every link is reached from the root: what is not is a loop."""
    todo = list(joints)
    while found := [joint for joint in todo if joint.parent in reached]:
        reached = reached | {joint.child for joint in found}
        todo = [joint for joint in todo if joint not in found]
    if todo:
        raise UrdfError(f'these links form a loop: {sorted(set(links) - reached)}')


def _check_unique(kind: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise UrdfError(f"there is more than one {kind} '{name}'")
