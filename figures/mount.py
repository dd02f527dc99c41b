"""The bracket between servo and lidar: its flat pattern at full size, side and front view.

All dimensions follow from the shapes of the robot model, from the sheet and from the lidar.
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

GAP = 1.5
"""Between an arm and a wing of the plate, for the bend [mm]."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Lidar:
    """A lidar on the plate, seen from above: x forward, y left [mm].

    Attributes
    ----------
    name
        Model.
    slots
        Where its screws may be: both ends of each slot; alike for a hole.
    screw
        Width of the slots.
    wing
        How far the plate reaches to the sides behind the arms; 0 for not at all.
    size
        Length and height of its shape, and x of its front.
    optical
        Its optical centre: x, and height above the plate.
    """

    name: str
    slots: tuple[tuple[Point, Point], ...]
    screw: float
    wing: float
    size: tuple[float, float, float]
    optical: tuple[float, float]


def _diagonal(radii: Point) -> tuple[tuple[Point, Point], ...]:
    """Return four slots that run outwards between two distances from the middle."""
    near, far = (radius / math.sqrt(2.0) for radius in radii)
    ways = (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)
    return tuple(((near * x, near * y), (far * x, far * y)) for x, y in ways)


# The shape of the robot model.
URG = Lidar('URG-04LX-UG01', _diagonal((13.0, 21.0)), 3.4, 0.0, (50.0, 70.0, 25.0), (0.0, 55.0))

# By its data sheet V1.0: two holes 46.8 mm apart, the third one 31.92 mm ahead; 34.8 mm high, the
# beams 7.8 mm below the top. The centre of rotation is 8.6 mm ahead of the two holes, by the model
# in github.com/Myzhar/ldrobot-lidar-ros2. It stands so far back that the two holes pass the arms.
_BACK = -20.6
_EARS = (_BACK, 23.4), (_BACK, -23.4), (_BACK + 31.92, 0.0)
LD19 = Lidar(
    'LD19',
    tuple((hole, hole) for hole in _EARS),
    2.5,
    28.0,
    (46.29, 34.8, _BACK + 31.92 + 3.58),
    (_BACK + 8.6, 34.8 - 7.8),
)

FILES = {'mount.svg': URG, 'mount_ld19.svg': LD19}
DIMENSIONS = 'top', 'bottom', 'optical', 'bend', 'flat_arm', 'flat_plate', 'unfolded', 'clearance'


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
        The lidar on the plate.
    """

    servo: tuple[float, float, float, float]
    plate: tuple[float, float]
    top: float
    bottom: float
    lidar: Lidar

    @property
    def optical(self) -> float:
        """Height of the optical centre above the nod axis."""
        return self.top + self.lidar.optical[1]

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


def mount_of(lidar: Lidar) -> Mount:
    """Return the bracket of the robot model, for a lidar."""
    robot = URDF.from_xml_string(xacro.process_file(str(MODEL)).toxml())
    servo, bracket = (
        robot.link_map[name].visuals[0] for name in ('nodlidar_base_link', 'nodlidar_tilt_link')
    )
    length, depth, height = _mm(servo.geometry.size)
    plate, width, tall = _mm(bracket.geometry.size)
    middle = 1e3 * bracket.origin.xyz[2]
    return Mount(
        (length, depth, height, 1e3 * servo.origin.xyz[2] + height / 2.0),
        (plate, width),
        middle + tall / 2.0,
        middle - tall / 2.0,
        lidar,
    )


def _mm(metres: Any) -> tuple[Any, ...]:
    return tuple(round(1e3 * value, 3) for value in metres)


def draw(folder: Path, _console: Console) -> Table:
    """Draw the bracket for each lidar, into files of FILES; return its dimensions."""
    table = Table('dimension, mm', *(lidar.name for lidar in FILES.values()), title='Bracket')
    mounts = [mount_of(lidar) for lidar in FILES.values()]
    for name, mount in zip(FILES, mounts, strict=True):
        drawing(mount).save(folder / name)
    for name in DIMENSIONS:
        table.add_row(name, *(f'{getattr(mount, name):.1f}' for mount in mounts))
    return table


def drawing(mount: Mount) -> Drawing:
    """Return the page: flat pattern, side view, front view, a bar to check the scale."""
    page = Drawing(*PAGE)
    title = f'nodlidar bracket for the lidar {mount.lidar.name}, 1:1 on A4, all in mm'
    page.text(10.0, 12.0, title, size=5.0)
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
    wing = max(mount.lidar.wing, plate)
    right = [(plate, -wide), (plate, -arm), (half, -arm), (half, arm), (plate, arm)]
    if wing > plate:
        right += [(plate, arm + GAP), (wing, arm + GAP)]
    right += [(wing, wide)]
    page.polygon([(x + a, y + b) for a, b in right + [(-a, b) for a, b in reversed(right)]])
    for side in (-1.0, 1.0):
        for edge in (plate, plate + mount.bend):
            at = x + side * edge
            page.line((at, y - arm), (at, y + arm), dashed=True)
        _horn(page, x + side * (half + mount.bottom), y)
    for (ahead, left), (far, farther) in mount.lidar.slots:
        _slot(page, (x - left, y - ahead), (x - farther, y - far), mount.lidar.screw)
    page.text(x - 6.0, y - wide + 6.0, 'forward')
    page.size((x - half, y + wide + 10.0), (x + half, y + wide + 10.0), mount.unfolded)
    page.size((x - plate, y - wide - 5.0), (x + plate, y - wide - 5.0), mount.flat_plate)
    page.size((x + half + 8.0, y - arm), (x + half + 8.0, y + arm), ARM)
    page.size((x - half - 8.0, y - wide), (x - half - 8.0, y + wide), mount.plate[0])
    page.size((x - half, y + arm + 5.0), (x - half - mount.bottom, y + arm + 5.0), -mount.bottom)


def _horn(page: Drawing, x: float, y: float) -> None:
    page.circle(x, y, HORN_CENTRE / 2.0)
    for (a, b), (c, d) in _diagonal(HORN):
        _slot(page, (x + a, y + b), (x + c, y + d), HORN_SLOTS)


def _slot(page: Drawing, begin: Point, end: Point, width: float) -> None:
    """Draw a slot, or a hole if it has no length."""
    if begin == end:
        page.circle(*begin, width / 2.0)
    else:
        page.slot(begin, end, width)


def _side(page: Drawing, mount: Mount, x: float, y: float) -> None:
    """Draw the sensor from its right, forward to the right, the nod axis at x, y."""
    length, _, height, highest = mount.servo
    page.rectangle(x - length / 2.0, y - highest, length, height)
    deep, tall, front = mount.lidar.size
    page.rectangle(x + front - deep, y - mount.top - tall, deep, tall)
    page.rectangle(x - mount.plate[0] / 2.0, y - mount.top, mount.plate[0], SHEET)
    page.rectangle(x - ARM / 2.0, y - mount.top, ARM, mount.top - mount.bottom)
    page.circle(x, y, 1.0)
    centre = x + mount.lidar.optical[0]
    page.line((centre, y - mount.optical), (x + 60.0, y - mount.optical), dashed=True)
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
