"""Another profile while the assembler runs: a new node takes over, with what the user has set."""

import time

from node_bench import sensor_log, simulated
from nodlidar_assembler.control.region_plan import RegionError
from nodlidar_assembler.profiles import PROFILES
from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_common.ros.executor import Executor
from nodlidar_msgs.action import ScanRegion
from nodlidar_sim.world.scene import load_scene
import pytest
import rclpy
from rclpy.parameter import Parameter

ARGUMENTS = ['--ros-args', '-p', 'coverage_window:=5.0', '-p', 'profile:=fast']


@pytest.fixture
def assembler():
    rclpy.init(args=ARGUMENTS)
    yield AssemblerNode()
    rclpy.shutdown()


def succeed(node, **values):
    """Set parameters of a node, all at once, and return its successor."""
    chosen = [Parameter(name, value=value) for name, value in values.items()]
    assert node.set_parameters_atomically(chosen).successful
    node.destroy_node()
    return node.successor()


def test_parameters_are_those_of_the_new_profile(assembler):
    assert (assembler.config.cloud_mode, assembler.config.command_rate) == ('scan', 4.0)
    node = succeed(assembler, profile='slam')
    slam = PROFILES['slam']
    assert (node.config.cloud_mode, node.config.ego_motion) == ('sweep', 'deskew')
    assert node.config.command_rate == slam.command_rate
    assert node.get_parameter('profile').value == 'slam'
    assert node.config.coverage_window == 5.0  # as given at the start
    node.destroy_node()


def test_what_was_set_while_it_ran_stays(assembler):
    assembler.set_parameters([Parameter('samples_per_sweep', value=2001)])
    second = succeed(assembler, profile='balanced', pitch_max=0.25, adapt_limits=True)
    third = succeed(second, profile='slam')
    config = third.config
    assert (config.samples_per_sweep, config.pitch_max, config.adapt_limits) == (2001, 0.25, True)
    third.destroy_node()


def test_the_nod_goes_on_without_waiting_for_a_scan(assembler):
    scan = sensor_log(simulated(load_scene('wall', ideal=True), 0.3)).scans[0]
    assembler._nod.follow_lidar(scan)
    before = assembler._nod.commanded
    node = succeed(assembler, profile='slam')
    now_ns = node._nod.now_ns()
    going_on = node._nod.commanded
    assert float(going_on.pitch(now_ns)) == pytest.approx(float(before.pitch(now_ns)), abs=0.005)
    assert float(going_on.velocity(now_ns)) == pytest.approx(float(before.velocity(now_ns)))
    node.destroy_node()


def test_a_region_that_was_begun_meanwhile_does_not_keep_the_nod(assembler):
    scan = sensor_log(simulated(load_scene('wall', ideal=True), 0.3)).scans[0]
    assembler._nod.follow_lidar(scan)
    assembler._region._begin(ScanRegion.Goal(pitch_min=-0.2, pitch_max=0.2, cell=0.1))
    node = AssemblerNode([], assembler._nod)
    assert not node._nod.controller.taken_over
    assert node._nod.commanded.pitch_max == pytest.approx(0.6136)
    assembler.destroy_node()
    node.destroy_node()


def test_no_region_is_begun_once_another_profile_is_chosen(assembler):
    assembler._nod.follow_lidar(
        sensor_log(simulated(load_scene('wall', ideal=True), 0.3)).scans[0]
    )
    assembler.set_parameters([Parameter('profile', value='slam')])
    with pytest.raises(RegionError, match='another profile takes over'):
        assembler._region._begin(ScanRegion.Goal(pitch_min=-0.2, pitch_max=0.2, cell=0.1))
    assembler.destroy_node()


def test_a_simulated_clock_that_was_chosen_while_it_ran_stays(assembler):
    assembler.set_parameters([Parameter('use_sim_time', value=True)])
    second = succeed(assembler, profile='balanced')
    assert second.get_parameter('use_sim_time').value is True
    second.destroy_node()


def test_what_is_refused_changes_nothing(assembler):
    for values in ({'profile': 'best'}, {'profile': 'slam', 'pitch_max': -1.0}):
        chosen = [Parameter(name, value=value) for name, value in values.items()]
        assert not assembler.set_parameters_atomically(chosen).successful
    assert assembler.successor is None
    assembler.destroy_node()


def test_the_first_node_leaves_nothing_in_ros(assembler):
    node = succeed(assembler, profile='slam')
    topics = ('/points', '/nod_command', '/assembler/scan_region/_action/status')
    executor, deadline = Executor(), time.monotonic() + 20.0
    executor.add_node(node)
    # The graph follows what is destroyed, the later the busier the host.
    while (found := [node.count_publishers(topic) for topic in topics]) != [1, 1, 1]:
        assert time.monotonic() < deadline, found
        executor.spin_once(timeout_sec=0.02)
    executor.shutdown()
    node.destroy_node()


def test_what_was_set_back_to_the_default_stays(assembler):
    second = succeed(assembler, profile='balanced', pitch_max=0.25)
    assert second.config.pitch_max == 0.25
    usual = PROFILES['slam'].pitch_max
    second.set_parameters([Parameter('pitch_max', value=usual)])
    third = succeed(second, profile='slam')
    assert third.config.pitch_max == usual
    third.destroy_node()


def test_a_profile_that_contradicts_what_is_set_is_refused():
    rclpy.init(args=[*ARGUMENTS, '-p', 'without_odometry:=uncompensated'])
    node = AssemblerNode()
    (result,) = node.set_parameters([Parameter('profile', value='slam')])
    assert not result.successful
    assert "'without_odometry' must be drop" in result.reason
    assert node.successor is None
    assert node.get_parameter('profile').value == 'fast'
    node.destroy_node()
    rclpy.shutdown()
