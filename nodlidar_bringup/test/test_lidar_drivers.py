"""Scans as the drivers of other lidars publish them, in a box, against the true walls.

The order of beams, stamps, times and lost beams are those of the drivers' sources; docs/lidars.md
names their versions.
"""

from dataclasses import replace
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.scan_input import ScanInput, ScanInputConfig
from nodlidar_assembler.ros.node import Assembler
from nodlidar_assembler.scan_assembler import ScanAssembler
from nodlidar_bringup.ros.launch_arguments import OTHER_DRIVERS
from nodlidar_common.parameter_file import read_parameters
from nodlidar_common.ros.messages import time_message
import numpy as np
import pytest
import rclpy
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import LaserScan

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


def scan(stamp, azimuths, ranges, scan_time, time_increment):
    message = LaserScan(
        angle_min=float(azimuths[0]),
        angle_max=float(azimuths[-1]),
        angle_increment=float((azimuths[-1] - azimuths[0]) / (len(azimuths) - 1)),
        scan_time=scan_time,
        time_increment=time_increment,
        range_min=0.05,
        range_max=12.0,
        ranges=ranges.astype(np.float32).tolist(),
    )
    message.header.stamp = time_message(T0 + round(stamp * 1e9))
    return message


def clockwise(begin, beams, lost, rng, turned=np.pi):
    """Return azimuths, ascending, and what a lidar that turns clockwise measured there."""
    index = np.arange(beams)
    azimuth = turned - 2.0 * np.pi * index / (beams - 1)
    ranges = ranges_at(begin + REVOLUTION * index / beams, azimuth)
    ranges[rng.random(beams) < 0.05] = lost
    return azimuth[::-1], ranges[::-1]


def rplidar(begin, rng):
    """sllidar_node.cpp: the stamp is when it began to wait, scan_time how long that took."""
    azimuths, ranges = clockwise(begin, 720, np.inf, rng)
    waited = REVOLUTION - rng.uniform(0.0, 0.002)
    return scan(begin + 0.002, azimuths, ranges, waited, waited / 719)


def ldlidar(begin, rng):
    """demo.cpp: 0 to 2 pi, the stamp is when it polls; the number of beams varies."""
    beams = int(rng.integers(447, 455))
    azimuths, ranges = clockwise(begin, beams, np.nan, rng, turned=2.0 * np.pi)
    return scan(begin + REVOLUTION, azimuths, ranges, REVOLUTION, REVOLUTION / (beams - 1))


def ydlidar(begin, rng):
    """ydlidar_ros2_driver_node.cpp and CYdLidar.cpp: lost beams are 0, time by the count."""
    azimuths, ranges = clockwise(begin, 505, 0.0, rng)
    return scan(begin, azimuths, ranges, REVOLUTION, REVOLUTION / 505)


def urg_node2(begin, rng):
    """urg_node2.cpp: counter-clockwise in a window of 270 degrees, NaN."""
    index = np.arange(1081)
    azimuth = -0.75 * np.pi + 2.0 * np.pi * index / 1440
    ranges = ranges_at(begin + 0.025 * index / 1440, azimuth)
    ranges[rng.random(1081) < 0.05] = np.nan
    return scan(begin, azimuth, ranges, 0.025, 0.025 / 1440)


DRIVERS = {'rplidar': rplidar, 'ldlidar': ldlidar, 'ydlidar': ydlidar, 'urg_node2': urg_node2}


def values_of(name):
    return dict(read_parameters(FOLDER / f'{name}.yaml')['/**']['ros__parameters'])


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
        assembler.add_scan(inputs.scan(DRIVERS[name](begin, rng), 0), 0)
        for outcome in assembler.ready(0):
            assert not outcome.dropped
            clouds += outcome.assembled.clouds
    points = [np.stack([cloud.data[axis] for axis in 'xyz'], axis=1) for cloud in clouds]
    return np.abs(np.abs(np.concatenate(points)) - BOX).min(axis=1)


def configured(values):
    own = {key: value for key, value in values.items() if key != 'qos_overrides'}
    return replace(AssemblerConfig(laser_xyz=(0.0, 0.0, HEIGHT)), **own)


def test_there_is_a_test_for_each_file():
    assert [path.stem for path in FILES] == sorted(DRIVERS) == sorted(OTHER_DRIVERS)


@pytest.mark.parametrize('name', DRIVERS)
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
        node = Assembler()
        ((qos,),) = [[each.qos_profile for each in node.get_subscriptions_info_by_topic('/scan')]]
        assert qos.reliability == ReliabilityPolicy.BEST_EFFORT
        node.destroy_node()
    finally:
        rclpy.shutdown()


def test_the_order_of_beams_is_undone_exactly():
    message = scan(0.0, np.linspace(-1.0, 1.0, 5), np.arange(1.0, 6.0), 0.1, 0.001)
    config = ScanInputConfig(last_beam_first=True)
    turned = ScanInput(config).scan(message, 0)
    assert turned.ranges.tolist() == [5.0, 4.0, 3.0, 2.0, 1.0]
    assert turned.geometry.angle_min == pytest.approx(1.0)
    assert turned.geometry.angle_increment == pytest.approx(-0.5)
