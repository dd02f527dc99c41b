"""The joints of a URDF and their transforms; no ROS in here."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from transforms3d.euler import euler2quat
from transforms3d.quaternions import axangle2quat, qmult
from urdf_parser_py import urdf

Vector = Sequence[float]
_TURNING = ('revolute', 'continuous')


class UrdfError(ValueError):
    """A robot description that is not a URDF of one tree, or has what is not covered."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint, and where its child is in its parent.

    Attributes
    ----------
    name, parent, child
        As in the URDF.
    turns
        Whether it is revolute or continuous; it is fixed otherwise.
    translation, rotation
        Pose of the joint [m] and quaternion (w, x, y, z).
    axis
        Axis of rotation in the joint's frame.
    """

    name: str
    parent: str
    child: str
    turns: bool
    translation: Vector
    rotation: Vector
    axis: Vector

    def pose(self, position: float) -> tuple[Vector, Vector]:
        """Return translation and quaternion (w, x, y, z) of the child at a position [rad]."""
        return self.translation, qmult(self.rotation, axangle2quat(self.axis, position))


def parse(description: str) -> list[Joint]:
    """Return the joints of a URDF.

    Raises
    ------
    UrdfError
        If it is empty, no URDF, not one tree of links, or has a joint that is not covered.
    """
    if not description:
        raise UrdfError('robot_description parameter must not be empty')
    try:
        model = urdf.Robot.from_xml_string(description.encode())
        model.get_root()
    except Exception as error:  # the parser raises errors of many types
        raise UrdfError(f'robot_description is not a URDF: {error}') from error
    return [_joint(each) for each in model.joints]


def _joint(urdf_joint: Any) -> Joint:
    name, kind, origin = urdf_joint.name, urdf_joint.type, urdf_joint.origin
    if kind not in (*_TURNING, 'fixed') or urdf_joint.mimic is not None:
        what = kind if urdf_joint.mimic is None else 'a mimic joint'
        raise UrdfError(
            f"joint '{name}' is {what}, but the underlay covers revolute, continuous and fixed "
            'joints only'
        )
    return Joint(
        name=name,
        parent=urdf_joint.parent,
        child=urdf_joint.child,
        turns=kind in _TURNING,
        translation=(origin and origin.xyz) or (0.0, 0.0, 0.0),
        rotation=euler2quat(*((origin and origin.rpy) or (0.0, 0.0, 0.0)), 'sxyz'),
        axis=urdf_joint.axis or (1.0, 0.0, 0.0),
    )
