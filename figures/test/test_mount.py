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

from figures.mount import ARM, drawing, MODEL, mount_of, PAGE, RADIUS, SHEET

MOUNT = mount_of()
DRAWN = Path(__file__).parents[2] / 'docs' / 'figures' / 'mount.svg'


def shapes(tag):
    return [each.attrib for each in drawing(MOUNT).root if each.tag == tag]


def outline():
    """Return the corners of the flat pattern, which has twelve [mm]."""
    [points] = [p['points'] for p in shapes('polygon') if p['points'].count(' ') == 11]
    return np.array([[float(word) for word in pair.split(',')] for pair in points.split()])


def test_the_optical_centre_is_where_the_assembler_takes_it_to_be():
    assert pytest.approx(1e3 * AssemblerConfig().laser_xyz[2]) == MOUNT.optical


def test_the_lidar_stands_on_the_plate():
    """In the robot model, lidar and bracket touch and do not overlap."""
    robot = URDF.from_xml_string(xacro.process_file(str(MODEL)).toxml())
    visual = robot.link_map['laser'].visuals[0]
    middle = 1e3 * visual.origin.xyz[2] + MOUNT.optical
    assert middle - 1e3 * visual.geometry.length / 2.0 == pytest.approx(MOUNT.top)


def test_the_flat_pattern_folds_to_the_bracket():
    """The neutral line of the bent sheet is as long as the flat pattern, piece by piece."""
    neutral = 0.42 * SHEET
    down = MOUNT.top - (SHEET + RADIUS) - MOUNT.bottom
    across = MOUNT.plate[1] - 2.0 * (SHEET + RADIUS)
    quarter = 2.0 * math.pi * (RADIUS + neutral) / 4.0
    corners = outline()
    assert np.ptp(corners[:, 0]) == pytest.approx(2.0 * (down + quarter) + across, abs=0.02)
    assert np.ptp(corners[:, 1]) == pytest.approx(MOUNT.plate[0], abs=0.02)
    assert (
        sorted(round(float(np.hypot(*(b - a))), 1) for a, b in pairwise(corners)).count(ARM) == 1
    )  # the other arm's end closes the outline


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


def test_it_prints_at_full_size():
    root = drawing(MOUNT).root
    assert (root.get('width'), root.get('height')) == ('297mm', '210mm')
    assert root.get('viewBox') == f'0 0 {PAGE[0]:g} {PAGE[1]:g}'
    for shape in shapes('line'):
        for key, value in shape.items():
            if key in ('x1', 'x2', 'y1', 'y2'):
                assert 5.0 < float(value) < PAGE[key[0] == 'y'] - 5.0


def test_the_page_shows_the_latest_drawing():
    """`python -m figures mount` draws it again."""
    drawn = drawing(MOUNT).root
    ElementTree.indent(drawn)
    assert DRAWN.read_bytes() == ElementTree.tostring(drawn, encoding='utf-8') + b'\n'
