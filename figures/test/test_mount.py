"""The drawing of the bracket fits the robot model, folds to its shape and clears the servo."""

from itertools import pairwise
import math
from pathlib import Path
import re
from xml.etree import ElementTree

from nodlidar_assembler.config import AssemblerConfig
from nodlidar_servo.device.config import ServoConfig
import numpy as np
import pytest
from urdf_parser_py.urdf import URDF
import xacro

from figures.mount import ARM, drawing, FILES, LD19, MODEL, mount_of, PAGE, RADIUS, SHEET, URG

MOUNT, MOUNT_LD19 = mount_of(URG), mount_of(LD19)
FIGURES = Path(__file__).parents[2] / 'docs' / 'figures'


def shapes(tag, mount=MOUNT):
    return [each.attrib for each in drawing(mount).root if each.tag == tag]


def outline(mount=MOUNT):
    """Return the corners of the flat pattern, which is drawn first [mm]."""
    points = shapes('polygon', mount)[0]['points']
    return np.array([[float(word) for word in pair.split(',')] for pair in points.split()])


def test_the_optical_centre_is_where_the_assembler_takes_it_to_be():
    assert pytest.approx(1e3 * AssemblerConfig().laser_xyz[2]) == MOUNT.optical


def test_the_lidar_stands_on_the_plate():
    """In the robot model, lidar and bracket touch and do not overlap."""
    robot = URDF.from_xml_string(xacro.process_file(str(MODEL)).toxml())
    visual = robot.link_map['laser'].visuals[0]
    middle = 1e3 * visual.origin.xyz[2] + MOUNT.optical
    assert middle - 1e3 * visual.geometry.length / 2.0 == pytest.approx(MOUNT.top)
    assert [2e3 * visual.geometry.radius, 1e3 * visual.geometry.length] == [*URG.size[:2]]


def test_the_flat_pattern_folds_to_the_bracket():
    """The neutral line of the bent sheet is as long as the flat pattern, piece by piece."""
    neutral = 0.42 * SHEET
    down = MOUNT.top - (SHEET + RADIUS) - MOUNT.bottom
    across = MOUNT.plate[1] - 2.0 * (SHEET + RADIUS)
    quarter = 2.0 * math.pi * (RADIUS + neutral) / 4.0
    corners = outline()
    assert np.ptp(corners[:, 0]) == pytest.approx(2.0 * (down + quarter) + across, abs=0.02)
    assert np.ptp(corners[:, 1]) == pytest.approx(MOUNT.plate[0], abs=0.02)
    edges = [round(float(np.hypot(*(b - a))), 1) for a, b in pairwise(corners)]
    assert edges.count(ARM) == 2


def test_bracket_and_servo_do_not_touch_within_the_limits():
    """Brute force: points of the plate's lower side, turned, against the servo's box."""
    length, _, height, highest = MOUNT.servo
    along = np.linspace(-MOUNT.plate[0] / 2.0, MOUNT.plate[0] / 2.0, 500)
    servo = ServoConfig()
    nearest = math.inf
    for pitch in np.linspace(servo.pitch_lower_limit, servo.pitch_upper_limit, 81):
        x = along * math.cos(pitch) - (MOUNT.top - SHEET) * math.sin(pitch)
        z = along * math.sin(pitch) + (MOUNT.top - SHEET) * math.cos(pitch)
        dx = np.maximum(np.abs(x) - length / 2.0, 0.0)
        dz = np.maximum(np.maximum(z - highest, highest - height - z), 0.0)
        nearest = min(nearest, float(np.min(np.hypot(dx, dz))))
    assert nearest > 1.5
    assert nearest >= MOUNT.clearance - 1e-9  # a bound for any pitch


def test_the_servo_fits_between_the_arms():
    assert MOUNT.plate[1] - 2.0 * SHEET >= MOUNT.servo[1] + 4.0  # two horns of 2 mm and more


def test_slots_lie_within_the_sheet():
    corners, slots = outline(), shapes('path')
    assert len(slots) == 12  # four in each arm and in the plate
    for slot in slots:
        ends = np.array(re.findall(r'[ML] ([\d.]+) ([\d.]+)', slot['d']), dtype=float)
        assert len(ends) == 3
        assert (ends > corners.min(axis=0) + 1.0).all()
        assert (ends < corners.max(axis=0) - 1.0).all()


def inside(polygon, point):
    """Return whether a polygon goes around a point."""
    way = polygon - point
    angle = np.unwrap(np.arctan2(way[:, 1], way[:, 0]), period=2.0 * math.pi)
    return abs(np.unwrap(np.append(angle, angle[0]))[-1] - angle[0]) > math.pi


def test_an_ld19_stands_on_its_three_holes_beside_the_bends():
    """Holes as its data sheet has them, each with 2.5 mm of sheet around, and none in a bend."""
    corners = outline(MOUNT_LD19)
    middle = (corners.max(axis=0) + corners.min(axis=0)) / 2.0
    holes = [
        np.array([float(circle['cx']), float(circle['cy'])])
        for circle in shapes('circle', MOUNT_LD19)
        if circle['r'] == '1.25'
    ]
    ahead, left, right = sorted(holes, key=lambda hole: (hole[1], hole[0]))
    np.testing.assert_allclose(right - left, [46.8, 0.0], atol=0.02)
    np.testing.assert_allclose((left + right) / 2.0 - ahead, [0.0, 31.92], atol=0.02)
    around = 3.75 * np.exp(1j * np.linspace(0.0, 2.0 * math.pi, 60))
    for hole in holes:
        for way in around:
            x, y = hole[0] + way.real, hole[1] + way.imag
            assert inside(corners, (x, y))
            assert abs(x - middle[0]) < MOUNT.flat_plate / 2.0 or abs(y - middle[1]) > ARM / 2.0


def test_the_beams_of_an_ld19_leave_where_its_data_sheet_says():
    """34.8 mm high, the lens 7.8 mm below the top, on a plate 25 mm above the axis."""
    assert MOUNT_LD19.optical == pytest.approx(25.0 + 27.0)
    robot = xacro.process_file(str(MODEL), mappings={'lidar': 'LD19'}).toxml()
    visual = URDF.from_xml_string(robot).link_map['laser'].visuals[0]
    top = 1e3 * (visual.origin.xyz[2] + visual.geometry.size[2] / 2.0)
    assert (top, 1e3 * visual.geometry.size[2]) == pytest.approx((7.8, 34.8))
    [centre, ahead] = LD19.optical[0], max(hole[0][0] for hole in LD19.slots)
    assert ahead - centre == pytest.approx(23.3, abs=0.2)  # 111 of 224 parts of 46.8 mm, drawn


@pytest.mark.parametrize('mount', [MOUNT, MOUNT_LD19], ids=['URG', 'LD19'])
def test_it_prints_at_full_size(mount):
    root = drawing(mount).root
    assert (root.get('width'), root.get('height')) == ('297mm', '210mm')
    assert root.get('viewBox') == f'0 0 {PAGE[0]:g} {PAGE[1]:g}'
    for shape in shapes('line', mount):
        for key, value in shape.items():
            if key in ('x1', 'x2', 'y1', 'y2'):
                assert 5.0 < float(value) < PAGE[key[0] == 'y'] - 5.0


@pytest.mark.parametrize(('name', 'lidar'), FILES.items())
def test_the_page_shows_the_latest_drawing(name, lidar):
    """`python -m figures mount` draws it again."""
    drawn = drawing(mount_of(lidar)).root
    ElementTree.indent(drawn)
    assert (FIGURES / name).read_bytes() == ElementTree.tostring(drawn, encoding='utf-8') + b'\n'
