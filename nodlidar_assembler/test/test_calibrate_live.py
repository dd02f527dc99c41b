"""The command calibrate takes the parameters of the running assembler."""

from contextlib import contextmanager
from dataclasses import replace
import threading

from nodlidar_assembler.bags.bag_types import Topics
from nodlidar_assembler.calibration.command import calibrate_and_report
from nodlidar_assembler.calibration.recorded import log_of_bag
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ros import live_log
from nodlidar_common.nod import Nod
from nodlidar_common.parameter_file import file_values
from nodlidar_common.ros.node_parameters import declare
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import LaserScan

NOD = Nod(-0.61, 0.61, 4001 * 0.1 / 1024, 4001, 10**18)
RUNNING = replace(
    AssemblerConfig(),
    joint_name='left_nod_joint',
    laser_xyz=(0.01, 0.02, -0.08),
    laser_rpy=(3.14159, 0.0, 0.0),
    mount_tilt=(0.0, 0.3),
)


@contextmanager
def running_assembler():
    """Run a node in the namespace left that has parameters and hears scans as the assembler."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('assembler', namespace='left', context=context)
    declare(node, AssemblerConfig, defaults=RUNNING)
    node.create_subscription(LaserScan, 'scan', lambda message: None, 5)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    try:
        yield
    finally:
        executor.shutdown()
        rclpy.shutdown(context=context)
        spinning.join()


@pytest.fixture
def node():
    rclpy.init()
    yield rclpy.create_node('calibrate')
    rclpy.shutdown()


def test_the_assembler_that_hears_the_scans_is_asked(node):
    with running_assembler():
        assert live_log.running_config(node, 'left/scan') == RUNNING


def test_without_an_assembler_defaults_are_taken_and_said(node, monkeypatch, capsys):
    monkeypatch.setattr(live_log, 'ANSWER', 0.1)
    assert live_log.running_config(node, 'right/scan') == AssemblerConfig()
    assert "no assembler hears '/right/scan'" in capsys.readouterr().err


@pytest.mark.parametrize('params', [False, True])
def test_what_the_scene_leaves_open_stays_as_the_node_has_it(tmp_path, params):
    """The y of the lidar shows in no scene; a parameter file overrides that of the node."""
    write_bag(
        simulate(load_scene('room', ideal=True), NOD, 2.5, start_ns=10**18), tmp_path / 'bag'
    )
    file = tmp_path / 'params.yaml'
    file.write_text('/**: {ros__parameters: {laser_xyz: [0.0, 0.03, 0.08]}}')
    running = replace(AssemblerConfig(), laser_xyz=(0.0, 0.02, 0.08))

    def record(config, *_):
        config = config or running
        return log_of_bag(tmp_path / 'bag', config, Topics('', '', '')), config

    found = tmp_path / 'found.yaml'
    options = ['--params', str(file)] if params else []
    calibrate_and_report(['live', '--output', str(found), *options], None, record)
    y = file_values(found, 'assembler', AssemblerConfig)['laser_xyz'][1]
    assert y == (0.03 if params else 0.02)
