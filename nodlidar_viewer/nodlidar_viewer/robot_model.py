"""The shapes of a robot model (URDF)."""

from dataclasses import dataclass

from nodlidar_common.errors import NodlidarError
from nodlidar_common.pose import Pose
from urdf_parser_py.urdf import Box, Cylinder, Sphere, URDF

GREY = (0.6, 0.6, 0.6)


class RobotModelError(NodlidarError):
    """A robot model that cannot be read."""


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A box, cylinder or sphere on a link.

    Attributes
    ----------
    link
        Name of the link.
    kind
        ``box``, ``cylinder`` (along z) or ``sphere``.
    size
        Of a box: its sides along x, y and z; of a cylinder: radius and length; of a sphere: its
        radius [m].
    pose
        Of its centre in the frame of the link.
    colour
        Red, green and blue, each 0 to 1.
    """

    link: str
    kind: str
    size: tuple[float, ...]
    pose: Pose
    colour: tuple[float, float, float]


def shapes_of(urdf: str) -> list[Shape]:
    """Return the shapes of a URDF, without meshes.

    Raises
    ------
    RobotModelError
        If it is not a URDF.
    """
    try:
        robot = URDF.from_xml_string(urdf.encode())
        return [
            shape
            for link in robot.links
            for visual in link.visuals
            if (shape := _shape(robot, link.name, visual)) is not None
        ]
    except Exception as error:  # of the XML parser or urdf_parser_py
        raise RobotModelError(f'robot_description is not a URDF: {error}') from error


def _shape(robot: URDF, link: str, visual: object) -> Shape | None:
    geometry, origin = visual.geometry, visual.origin  # type: ignore[attr-defined]
    match geometry:
        case Box():
            kind, size = 'box', tuple(geometry.size)
        case Cylinder():
            kind, size = 'cylinder', (geometry.radius, geometry.length)
        case Sphere():
            kind, size = 'sphere', (geometry.radius,)
        case _:
            return None
    pose = Pose.from_xyzrpy([*origin.xyz, *origin.rpy] if origin else [0.0] * 6)
    return Shape(link, kind, size, pose, _colour(robot, visual))


def _colour(robot: URDF, visual: object) -> tuple[float, float, float]:
    """Return the colour of a visual; materials may be defined once and used by name."""
    material = visual.material  # type: ignore[attr-defined]
    named = {known.name: known for known in robot.materials}
    for each in (material, named.get(getattr(material, 'name', None))):
        if each is not None and each.color is not None:
            red, green, blue, _ = each.color.rgba
            return red, green, blue
    return GREY
