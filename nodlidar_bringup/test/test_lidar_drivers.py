"""Scans as the drivers of other lidars publish them, in a box, against the true walls.

The order of beams, stamps, times and lost beams are those of nodlidar_sim.devices.other_lidars.
"""

from dataclasses import replace
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.scan_input import ScanInput, ScanInputConfig
from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_assembler.scan_assembler import ScanAssembler
from nodlidar_common.ldrobot import LD19
from nodlidar_common.parameter_file import read_parameters
from nodlidar_sim.devices.other_lidars import OTHER_LIDARS, Published, Revolution
from nodlidar_sim.ros.scan_publisher import scan_message
import numpy as np
import pytest
import rclpy
from rclpy.qos import ReliabilityPolicy

FOLDER = Path(get_package_share_directory('nodlidar_bringup')) / 'config' / 'lidars'
FILES = sorted(FOLDER.glob('*.yaml'))
T0 = 1_763_900_000_000_000_000
BOX = np.array([2.6, 2.1, 1.3])  # m, half its sides
HEIGHT = 0.08  # m, of the lidar above the axis
REVOLUTION = 0.1  # s


def pitch_at(seconds):
    """Up is positive; 1.5 rad/s at most."""
    return 0.6 * np.sin(2.5 * seconds)


def ranges_at(seconds, azimuth):
    """The true ranges [m] of beams in the laser's frame."""
    pitch = pitch_at(seconds)
    cos, sin = np.cos(pitch), np.sin(pitch)
    x, y = np.cos(azimuth), np.sin(azimuth)
    direction = np.stack([cos * x, y, sin * x])
    origin = np.stack([-sin * HEIGHT, 0.0 * sin, cos * HEIGHT])
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.nanmin((np.sign(direction) * BOX[:, None] - origin) / direction, axis=0)


def message(name, begin, rng):
    """Return the scan of a revolution whose first beam is measured at a time [s]."""
    lidar = OTHER_LIDARS[name]
    begin_ns = T0 + round(begin * 1e9)
    times_ns, azimuths = lidar.rays(begin_ns, int(rng.integers(*lidar.beams, endpoint=True)))
    ranges = ranges_at((times_ns - T0) / 1e9, azimuths)
    ranges[rng.random(len(ranges)) < 0.05] = np.nan
    # An ldlidar is polled at once; of the others, only an rplidar's scan says when they are got.
    since_ns = begin_ns + (2_000_000 if name == 'rplidar' else 0)
    jitter = rng.uniform(0.0, 0.002) if name == 'rplidar' else 0.0
    fetched_ns = since_ns + round((REVOLUTION - jitter) * 1e9)
    revolution = Revolution(times_ns, azimuths, REVOLUTION, since_ns, fetched_ns)
    return scan_message(lidar.published(revolution, ranges), 'laser')


def values_of(name):
    return dict(read_parameters(FOLDER / f'{name}.yaml')['/**'])


def errors(name, config, count=30):
    """Return the distance of each point to the nearest wall [m], and the refused scans."""
    rng = np.random.default_rng(3)
    inputs, assembler = ScanInput(config), ScanAssembler(config)
    period = 0.025 if name == 'urg_node2' else REVOLUTION
    begins = 0.05 + period * np.arange(count)
    for time in np.arange(0.0, 0.4 + period * count, 0.005):
        assembler.add_joint_sample(T0 + round(time * 1e9), float(pitch_at(time)))
    clouds = []
    for begin in begins:
        assembler.add_scan(inputs.scan(message(name, begin, rng), 0), 0)
        for outcome in assembler.ready(0):
            assert not outcome.dropped
            clouds += outcome.assembled.clouds
    points = np.concatenate([cloud.xyz for cloud in clouds])
    return np.abs(np.abs(points) - BOX).min(axis=1)


def configured(values):
    own = {key: value for key, value in values.items() if key != 'qos_overrides'}
    return replace(AssemblerConfig(laser_xyz=(0.0, 0.0, HEIGHT)), **own)


def test_there_is_a_test_for_each_file():
    """That of an LD19, with our driver, is that of test_robot_launch_two_sensors.py."""
    assert [path.stem for path in FILES] == sorted([LD19, *OTHER_LIDARS])


@pytest.mark.parametrize('name', OTHER_LIDARS)
def test_points_are_on_the_walls(name):
    found = errors(name, configured(values_of(name)))
    assert len(found) > 9_000
    assert np.median(found) < 2e-3
    assert np.quantile(found, 0.95) < 1e-2


@pytest.mark.parametrize('name', ['rplidar', 'ldlidar', 'ydlidar'])
def test_without_the_order_of_the_beams_they_are_not(name):
    found = errors(name, configured({**values_of(name), 'last_beam_first': False}))
    assert np.quantile(found, 0.95) > 5e-2


def test_the_file_for_ydlidar_lets_best_effort_scans_in():
    rclpy.init(args=['--ros-args', '--params-file', str(FOLDER / 'ydlidar.yaml')])
    try:
        node = AssemblerNode()
        ((qos,),) = [[each.qos_profile for each in node.get_subscriptions_info_by_topic('/scan')]]
        assert qos.reliability == ReliabilityPolicy.BEST_EFFORT
        node.destroy_node()
    finally:
        rclpy.shutdown()


def test_the_order_of_beams_is_undone_exactly():
    ranges = np.arange(1.0, 6.0, dtype=np.float32)
    published = Published(T0, -1.0, 1.0, 0.5, 0.001, 0.1, 0.05, 12.0, ranges)
    config = ScanInputConfig(last_beam_first=True)
    turned = ScanInput(config).scan(scan_message(published, 'laser'), 0)
    assert turned.ranges.tolist() == [5.0, 4.0, 3.0, 2.0, 1.0]
    assert turned.geometry.angle_min == pytest.approx(1.0)
    assert turned.geometry.angle_increment == pytest.approx(-0.5)
