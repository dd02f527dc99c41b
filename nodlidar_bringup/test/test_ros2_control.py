"""The example for ros2_control: its tag, its controllers, and the node that sends to them."""

from pathlib import Path
from xml.etree import ElementTree

from launch import LaunchContext
from nodlidar_bringup.ros import sensor
from nodlidar_bringup.ros.launch_arguments import ARGUMENTS
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_sim.devices.controlled_joint import UPDATE_RATE
import pytest
import rclpy
from urdf_parser_py.urdf import URDF
import xacro

FOLDER = Path(__file__).parents[1]
CONTROLLERS = FOLDER / 'config' / 'controllers.yaml'
CONFIG = TrajectoryConfig()
TYPES = {
    'joint_state_broadcaster': 'joint_state_broadcaster/JointStateBroadcaster',
    'joint_trajectory_controller': 'joint_trajectory_controller/JointTrajectoryController',
}


def description(name, **arguments):
    path = FOLDER / 'urdf' / f'{name}.urdf.xacro'
    return xacro.process_file(str(path), mappings=arguments).toxml()


def joint(**arguments):
    """Return the joint in the tag ros2_control."""
    model = ElementTree.fromstring(description('ros2_control', **arguments))
    (found,) = model.findall('ros2_control/joint')
    return found


@pytest.fixture
def parameters():
    """Return a function from a node to its parameters in controllers.yaml, as ROS reads them."""
    context = rclpy.Context()
    rclpy.init(context=context)

    def of(name):
        node = rclpy.create_node(
            name,
            context=context,
            cli_args=['--ros-args', '--params-file', str(CONTROLLERS)],
            use_global_arguments=False,
            automatically_declare_parameters_from_overrides=True,
        )
        values = {key: each.value for key, each in node.get_parameters_by_prefix('').items()}
        node.destroy_node()
        return values

    yield of
    rclpy.shutdown(context=context)


@pytest.mark.parametrize('prefix', ['', 'left_'])
def test_the_joint_of_ros2_control_is_the_nodding_one_of_the_same_robot(prefix):
    models = [
        URDF.from_xml_string(description(name, prefix=prefix))
        for name in ('robot', 'ros2_control')
    ]
    assert models[0].joint_map.keys() == models[1].joint_map.keys()
    assert joint(prefix=prefix).get('name') == f'{prefix}nod_joint'


@pytest.mark.parametrize('name', ['robot', 'ros2_control'])
def test_a_copy_in_another_folder_is_the_same_robot(tmp_path, name):
    original = FOLDER / 'urdf' / f'{name}.urdf.xacro'
    copy = tmp_path / 'my robot.urdf.xacro'
    copy.write_text(original.read_text())
    robots = [xacro.process_file(str(path)).documentElement.toxml() for path in (original, copy)]
    assert robots[0] == robots[1]


def test_the_controller_manager_loads_the_controller_that_the_node_sends_to(parameters):
    manager = parameters('controller_manager')
    assert {name: manager[f'{name}.type'] for name in TYPES} == TYPES
    assert CONFIG.controller in TYPES
    assert manager['update_rate'] >= 10.0 * CONFIG.send_rate
    assert manager['update_rate'] == UPDATE_RATE  # as in simulation


def test_the_controller_moves_the_joint_by_the_interfaces_that_the_hardware_has(parameters):
    controller = parameters(CONFIG.controller)
    assert controller['joints'] == [CONFIG.joint_name]
    for kind in ('command', 'state'):
        offered = [each.get('name') for each in joint().findall(f'{kind}_interface')]
        assert controller[f'{kind}_interfaces'] == offered


def test_a_newer_controller_begins_a_trajectory_at_its_stamp(parameters):
    """By default, one of ros2_controllers after 6.9 begins it on arrival: there is no nod."""
    assert parameters(CONFIG.controller)['allow_trajectory_replacement'] is False


@pytest.mark.parametrize('name', ['ros2_control', 'path'])
def test_the_launch_publishes_the_chosen_description(monkeypatch, tmp_path, name):
    monkeypatch.setattr(sensor, 'tied_node', lambda *_, **options: options['parameters'])
    monkeypatch.setattr(sensor, 'text', str)
    if name == 'path':
        path = tmp_path / 'own.urdf.xacro'
        path.write_text('<robot name="own"><link name="base_link"/></robot>')
        name = str(path)
    context = LaunchContext()
    defaults = {key: options['default_value'] for key, options in ARGUMENTS.items()}
    given = {'hardware': 'real', 'servo': 'trajectory', 'description': name}
    context.launch_configurations.update(defaults | given)
    *_, own = sensor.Sensor(context).state_publisher()
    published = own['robot_description']
    assert ('<ros2_control' in published) == (name == 'ros2_control')
    assert ('name="own"' in published) == (name != 'ros2_control')
