"""The launch file for two sensors side by side, each with arguments of its own."""

from nodlidar_bringup.ros.launched import launched_sensor
from nodlidar_common.stamps import NS_PER_S, time_ns
import numpy as np
from observer import Observer
from on_the_room import assert_on_the_room_all_around, CLOUDS
import pytest
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.time import Time
from sensor_msgs.msg import JointState, LaserScan, PointCloud2
from tf2_msgs.msg import TFMessage

SIDES = 'left', 'right'


def parameters(observer, node, *names):
    """Return the values of a running assembler."""
    client = AsyncParameterClient(observer.node, node)
    observer.spin_until(client.services_are_ready, 'the assembler')
    answer = client.get_parameters(list(names))
    observer.spin_until(answer.done, 'parameters')
    return [parameter_value_to_python(value) for value in answer.result().values]


@pytest.fixture(scope='module')
def two_sensors(tmp_path_factory):
    """Run two sensors with servos of both protocols.

    The left one has a profile and its lidar in another place; the right one, with an LD19 in a
    room, is in two launches, as on two machines, and has a file of the assembler.
    """
    folder = tmp_path_factory.mktemp('launch')
    file = folder / 'assembler.yaml'
    file.write_text('/**: {ros__parameters: {max_nod_speed: 2.5}}\n')
    observer = Observer()
    observer.subscribe(TFMessage, '/tf')
    for side in SIDES:
        observer.subscribe(LaserScan, f'{side}/scan')
        observer.subscribe(JointState, f'{side}/joint_states')
        observer.subscribe(PointCloud2, f'{side}/points')
    left, right = (
        (f'namespace:=/{side}', f'frame_prefix:={side}_', f'scene:={scene}', 'ideal:=true')
        for side, scene in zip(SIDES, ('wall', 'room'), strict=True)
    )
    place = 'laser_xyz:=0.01 0 -5e-2', 'laser_rpy:=0 0 3.141592653589793'
    right = (*right, 'lidar:=LD19', 'servo:=XL430-W250', f'assembler_params:={file}')
    with (
        launched_sensor(folder / 'left.log', *left, 'profile:=fast', *place),
        launched_sensor(folder / 'right.log', *right, 'nodes:=devices'),
        launched_sensor(folder / 'other.log', *right, 'nodes:=clouds'),
    ):
        yield observer
    observer.close()


def test_two_sensors_run_side_by_side_under_their_namespaces(two_sensors):
    messages = two_sensors.messages
    # Each topic is found in its own time.
    topics = [f'{side}/{name}' for side in SIDES for name in ('scan', 'joint_states', 'points')]
    two_sensors.spin_until(lambda: all(messages[topic] for topic in topics), 'all topics')
    for side in SIDES:
        assert messages[f'{side}/points'][-1].header.frame_id == f'{side}_nodlidar_base_link'
        assert messages[f'{side}/scan'][-1].header.frame_id == f'{side}_laser'
        assert list(messages[f'{side}/joint_states'][-1].name) == [f'{side}_nod_joint']


def test_clouds_of_an_ld19_lie_on_the_room_all_around(two_sensors):
    scans, clouds = (two_sensors.messages[f'right/{topic}'] for topic in ('scan', 'points'))
    two_sensors.spin_until(lambda: len(clouds) >= CLOUDS, 'clouds')
    assert_on_the_room_all_around(scans, 450, clouds)


def test_a_profile_is_the_assembler_s_and_sets_the_rates_of_joint_states_and_tf(two_sensors):
    messages = two_sensors.messages
    heard = messages['left/points'], messages['left/joint_states']
    two_sensors.spin_until(lambda: all(len(topic) > 40 for topic in heard), 'both topics')
    found = parameters(two_sensors, 'left/assembler', 'profile', 'coverage_window')
    assert found == ['fast', 0.0]
    stamps = [time_ns(state.header.stamp) for state in messages['left/joint_states']]
    assert np.median(np.diff(stamps)) == pytest.approx(NS_PER_S / 16.0, rel=0.1)
    nods = [transform for tf in messages['/tf'] for transform in tf.transforms]
    assert {nod.child_frame_id for nod in nods} == {f'{s}_nodlidar_tilt_link' for s in SIDES}
    stamps = [time_ns(nod.header.stamp) for nod in nods if nod.child_frame_id.startswith('left')]
    # At most 10 Hz; robot_state_publisher takes the next joint state then.
    assert np.median(np.diff(stamps)) > 0.09 * NS_PER_S


def test_the_lidar_s_place_is_the_assembler_s_and_the_model_s(two_sensors):
    frames = 'left_nodlidar_tilt_link', 'left_laser', Time()
    xyz, rpy = map(list, parameters(two_sensors, 'left/assembler', 'laser_xyz', 'laser_rpy'))
    two_sensors.spin_until(lambda: two_sensors.transforms.can_transform(*frames), 'the model')
    assert (xyz, rpy) == ([0.01, 0.0, -0.05], [0.0, 0.0, np.pi])
    transform = two_sensors.transforms.lookup_transform(*frames).transform
    p, q = transform.translation, transform.rotation
    assert [p.x, p.y, p.z] == pytest.approx(xyz)
    assert [q.x, q.y, q.z, q.w] == pytest.approx([0.0, 0.0, 1.0, 0.0])


def test_the_assembler_plans_for_the_servo_unless_its_file_says_otherwise(two_sensors):
    limits = 'max_nod_speed', 'max_nod_acceleration'
    found = parameters(two_sensors, 'right/assembler', *limits)
    assert found == pytest.approx([2.5, 150.0], rel=1e-3)
