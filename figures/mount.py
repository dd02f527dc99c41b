"""The bracket between servo and lidar: its flat pattern at full size, side and front view.

All dimensions follow from the shapes of the robot model and from the sheet.
"""

from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from urdf_parser_py.urdf import URDF
import xacro

from figures.svg import Drawing

MODEL = Path(__file__).parent.parent / 'nodlidar_bringup' / 'urdf' / 'robot.urdf.xacro'
PAGE = (297.0, 210.0)
"""A4 [mm]."""

SHEET, RADIUS, NEUTRAL = 2.0, 2.0, 0.42
"""Sheet of aluminium and inner radius of its bends [mm]; place of the neutral line in the sheet
(K factor, usual for air bending with a radius of one thickness)."""

ARM = 30.0
"""Width of the arms [mm]."""

HORN, HORN_SLOTS, HORN_CENTRE = (7.0, 9.0), 2.4, 9.0
"""Radii between which the slots for the horn's screws run, their width, diameter of the hole for
the screw in the middle [mm]: for circles of 14 to 18 mm."""

LIDAR_SLOTS, LIDAR_SCREW = (13.0, 21.0), 3.4
"""Distances from the middle along which the slots for the lidar's screws run, diagonally, and
their width [mm]."""


@dataclass(frozen=True)
class Mount:
    """The dimensions [mm], from the nod axis: x forward, y left, z up.

    Attributes
    ----------
    servo
        Length x, depth y and height z of the servo; its highest z.
    plate
        Length x of the plate that carries the lidar, outer width y of the bracket.
    top, bottom
        z of the plate's upper side and of the lower end of the arms.
    lidar
        Diameter and height of the lidar.
    optical
        z of the optical centre.
    """

    servo: tuple[float, float, float, float]
    plate: tuple[float, float]
    top: float
    bottom: float
    lidar: tuple[float, float]
    optical: float

    @property
    def bend(self) -> float:
        """Length of the neutral line in a bend of a right angle."""
        return math.pi / 2.0 * (RADIUS + NEUTRAL * SHEET)

    @property
    def flat_arm(self) -> float:
        """Straight part of an arm."""
        return self.top - SHEET - RADIUS - self.bottom

    @property
    def flat_plate(self) -> float:
        """Straight part of the plate across."""
        return self.plate[1] - 2.0 * (SHEET + RADIUS)

    @property
    def unfolded(self) -> float:
        """Length of the flat pattern."""
        return 2.0 * (self.flat_arm + self.bend) + self.flat_plate

    @property
    def clearance(self) -> float:
        """Distance from the plate to the servo's upper edges, which is least when they face it."""
        length, _, _, highest = self.servo
        return self.top - SHEET - math.hypot(length / 2.0, highest)


def mount_of(model: Path = MODEL) -> Mount:
    """Return the dimensions of the shapes in a robot model."""
    robot = URDF.from_xml_string(xacro.process_file(str(model)).toxml())
    servo, bracket, lidar = (
        robot.link_map[name].visuals[0]
        for name in ('nodlidar_base_link', 'nodlidar_tilt_link', 'laser')
    )
    optical = 1e3 * robot.joint_map['laser_mount'].origin.xyz[2]
    length, depth, height = _mm(servo.geometry.size)
    plate, width, tall = _mm(bracket.geometry.size)
    middle = 1e3 * bracket.origin.xyz[2]
    return Mount(
        (length, depth, height, 1e3 * servo.origin.xyz[2] + height / 2.0),
        (plate, width),
        middle + tall / 2.0,
        middle - tall / 2.0,
        _mm((2.0 * lidar.geometry.radius, lidar.geometry.length)),
        optical,
    )


def _mm(metres: Any) -> tuple[Any, ...]:
    return tuple(round(1e3 * value, 3) for value in metres)


def draw(folder: Path, _console: Console) -> Table:
    """Draw the bracket into mount.svg; return its dimensions."""
    mount = mount_of()
    drawing(mount).save(folder / 'mount.svg')
    table = Table('dimension', 'mm', title='Bracket')
    for name in ('top', 'bottom', 'optical', 'bend', 'flat_arm', 'flat_plate', 'unfolded'):
        table.add_row(name, f'{getattr(mount, name):.1f}')
    table.add_row('clearance', f'{mount.clearance:.1f}')
    return table


def drawing(mount: Mount) -> Drawing:
    """Return the page: flat pattern, side view, front view, a bar to check the scale."""
    page = Drawing(*PAGE)
    page.text(10.0, 12.0, 'nodlidar bracket, 1:1 on A4, all in mm', size=5.0)
    page.text(
        10.0, 19.0, f'aluminium {SHEET:g}, inner radius of bends {RADIUS:g}; both bends down'
    )
    _flat_pattern(page, mount, 28.0 + mount.unfolded / 2.0, 72.0)
    _side(page, mount, 212.0, 135.0)
    _front(page, mount, 81.0, 160.0)
    page.line((190.0, 200.0), (240.0, 200.0), width=0.5)
    page.text(190.0, 197.0, 'this bar is 50 mm: check the scale of the print')
    return page


def _flat_pattern(page: Drawing, mount: Mount, x: float, y: float) -> None:
    """Draw what is cut out and bent, its middle at x, y; the arms lie left and right."""
    half, wide = mount.unfolded / 2.0, mount.plate[0] / 2.0
    plate, arm = mount.flat_plate / 2.0, ARM / 2.0
    outline = [(-half, -arm), (-plate, -arm), (-plate, -wide), (plate, -wide), (plate, -arm)]
    outline += [(half, -arm), (half, arm), (plate, arm), (plate, wide), (-plate, wide)]
    outline += [(-plate, arm), (-half, arm)]
    page.polygon([(x + a, y + b) for a, b in outline])
    for side in (-1.0, 1.0):
        for edge in (plate, plate + mount.bend):
            at = x + side * edge
            page.line((at, y - arm), (at, y + arm), dashed=True)
        _horn(page, x + side * (half + mount.bottom), y)
    for angle in (45.0, 135.0, 225.0, 315.0):
        _slot(page, x, y, angle, LIDAR_SLOTS, LIDAR_SCREW)
    page.size((x - half, y + wide + 10.0), (x + half, y + wide + 10.0), mount.unfolded)
    page.size((x - plate, y - wide - 5.0), (x + plate, y - wide - 5.0), mount.flat_plate)
    page.size((x + half + 8.0, y - arm), (x + half + 8.0, y + arm), ARM)
    page.size((x - half - 8.0, y - wide), (x - half - 8.0, y + wide), mount.plate[0])
    page.size((x - half, y + arm + 5.0), (x - half - mount.bottom, y + arm + 5.0), -mount.bottom)


def _horn(page: Drawing, x: float, y: float) -> None:
    page.circle(x, y, HORN_CENTRE / 2.0)
    for angle in (45.0, 135.0, 225.0, 315.0):
        _slot(page, x, y, angle, HORN, HORN_SLOTS)


def _slot(
    page: Drawing, x: float, y: float, angle: float, radii: tuple[float, float], width: float
) -> None:
    """Draw a slot that runs outwards from a point."""
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    ends = [(x + radius * cos, y + radius * sin) for radius in radii]
    page.slot(ends[0], ends[1], width)


def _side(page: Drawing, mount: Mount, x: float, y: float) -> None:
    """Draw the sensor from its right, forward to the right, the nod axis at x, y."""
    length, _, height, highest = mount.servo
    page.rectangle(x - length / 2.0, y - highest, length, height)
    diameter, tall = mount.lidar
    page.rectangle(x - diameter / 2.0, y - mount.top - tall, diameter, tall)
    page.rectangle(x - mount.plate[0] / 2.0, y - mount.top, mount.plate[0], SHEET)
    page.rectangle(x - ARM / 2.0, y - mount.top, ARM, mount.top - mount.bottom)
    page.circle(x, y, 1.0)
    page.line((x, y - mount.optical), (x + 60.0, y - mount.optical), dashed=True)
    page.text(x + 30.0, y - mount.optical - 1.5, 'beams')
    page.size((x + 45.0, y), (x + 45.0, y - mount.optical), mount.optical)
    page.size((x - 40.0, y), (x - 40.0, y - mount.top), mount.top)
    page.text(x - 30.0, y + 46.0, 'from the right; forward is to the right')


def _front(page: Drawing, mount: Mount, x: float, y: float) -> None:
    """Draw servo and bracket from the front, the nod axis at the height y."""
    _, depth, height, highest = mount.servo
    width = mount.plate[1]
    page.rectangle(x - depth / 2.0, y - highest, depth, height)
    page.rectangle(x - width / 2.0, y - mount.top, width, SHEET)
    for left in (x - width / 2.0, x + width / 2.0 - SHEET):
        page.rectangle(left, y - mount.top, SHEET, mount.top - mount.bottom)
    page.line((x - 30.0, y), (x + 30.0, y), dashed=True)
    page.text(x + 31.0, y + 1.0, 'nod axis')
    page.size((x - width / 2.0, y - 30.0), (x + width / 2.0, y - 30.0), width)
    inner = width - 2.0 * SHEET
    page.size((x - inner / 2.0, y - 38.0), (x + inner / 2.0, y - 38.0), inner)
    page.text(x - 30.0, y + 46.0, 'from the front, without the lidar')
