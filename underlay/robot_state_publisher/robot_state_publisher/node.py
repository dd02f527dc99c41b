"""The node: parameters and joint states in, transforms out."""

from collections.abc import Callable
import signal
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rcl_interfaces.msg import SetParametersResult
import rclpy
from rclpy.exceptions import InvalidParameterValueException, ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSPolicyKind, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions
from robot_state_publisher.kinematics import Joint, parse, UrdfError
from robot_state_publisher.throttle import Throttle
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_LATCHED_POLICIES = (QoSPolicyKind.DEPTH, QoSPolicyKind.HISTORY, QoSPolicyKind.RELIABILITY)
_POLICIES = (*_LATCHED_POLICIES, QoSPolicyKind.DURABILITY)


class RobotStatePublisher(Node):
    """Publishes a robot's fixed joints once and its moving joints as their states come in."""

    def __init__(self) -> None:
        super().__init__('robot_state_publisher')
        description = self.declare_parameter('robot_description', '').value
        self._check_frequency(self.declare_parameter('publish_frequency', 20.0).value)
        self.declare_parameter('frame_prefix', '')
        self.declare_parameter('ignore_timestamp', False)
        self._throttle = Throttle()
        self._static: dict[str, TransformStamped] = {}
        self._tf = self._create_transform_publisher('/tf', 100, _POLICIES)
        self._tf_static = self._create_transform_publisher(
            '/tf_static', _LATCHED, _LATCHED_POLICIES
        )
        self._description = self.create_publisher(String, 'robot_description', _LATCHED)
        self._set_up(description)
        self.create_subscription(
            JointState,
            'joint_states',
            self._joint_states_arrived,
            qos_profile_sensor_data,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

    def _create_transform_publisher(self, topic: str, qos: Any, policies: Any) -> Publisher:
        options = QoSOverridingOptions(policies)
        return self.create_publisher(TFMessage, topic, qos, qos_overriding_options=options)

    def _set_up(self, description: str) -> None:
        """Take over a description and publish it with its fixed joints."""
        self._robot = parse(description)
        self._description.publish(String(data=description))
        now = self.get_clock().now().to_msg()
        for _, joint in sorted(self._robot.fixed.items()):
            transform = self._transform(joint, 0.0, now)
            self._static[transform.child_frame_id] = transform
        self._tf_static.publish(TFMessage(transforms=list(self._static.values())))
        self.get_logger().info('Robot initialized')

    def _joint_states_arrived(self, state: JointState) -> None:
        if len(state.name) != len(state.position):
            self._refuse(state)
            return
        now_ns = self.get_clock().now().nanoseconds
        if self._throttle.went_back(now_ns):
            self.get_logger().warning('Moved backwards in time, re-publishing joint transforms!')
        stamp_ns = rclpy.time.Time.from_msg(state.header.stamp).nanoseconds
        due = self._throttle.due(state.name, stamp_ns, now_ns, self._interval_ns())
        if due or self.get_parameter('ignore_timestamp').value:
            moved = self._robot.moved(state.name, state.position)
            transforms = [self._transform(*each, state.header.stamp) for each in moved]
            self._tf.publish(TFMessage(transforms=transforms))
            self._throttle.published(state.name, stamp_ns)

    def _refuse(self, state: JointState) -> None:
        if state.position:
            self.get_logger().error('Robot state publisher ignored an invalid JointState message')
        else:
            self.get_logger().warning(
                'Robot state publisher ignored a JointState message about joint(s) '
                f'"{state.name[0]}"(,...) whose position member was empty.'
            )

    def _interval_ns(self) -> int:
        """Return the time between two states of a joint, in whole milliseconds; 0 is no limit."""
        frequency = self.get_parameter('publish_frequency').value
        return int(1000.0 / frequency) * 1_000_000 if frequency else 0

    def _transform(self, joint: Joint, position: float, stamp: Time) -> TransformStamped:
        prefix = self.get_parameter('frame_prefix').value
        message = TransformStamped(child_frame_id=prefix + joint.child)
        message.header.stamp = stamp
        message.header.frame_id = prefix + joint.parent
        (x, y, z), (qw, qx, qy, qz) = joint.pose(position)
        translation, rotation = message.transform.translation, message.transform.rotation
        translation.x, translation.y, translation.z = float(x), float(y), float(z)
        rotation.x, rotation.y, rotation.z = float(qx), float(qy), float(qz)
        rotation.w = float(qw)
        return message

    def _check_parameters(self, parameters: list[rclpy.Parameter]) -> SetParametersResult:
        try:
            for parameter in parameters:
                if parameter.name == 'robot_description':
                    parse(parameter.value)
                elif parameter.name == 'publish_frequency':
                    self._check_frequency(parameter.value)
        except (UrdfError, InvalidParameterValueException) as error:
            self.get_logger().warning(str(error))
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, parameters: list[rclpy.Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == 'robot_description':
                self._set_up(parameter.value)

    @staticmethod
    def _check_frequency(frequency: float) -> None:
        if not 0.0 <= frequency <= 1000.0:
            raise InvalidParameterValueException(
                'publish_frequency', frequency, 'it must be between 0 and 1000'
            )


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit status."""
    received: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _: received.append(got))
    # rclpy's own handlers end its context in the middle of whatever is going on, or are missed.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        _spin_until(lambda: bool(received), RobotStatePublisher())
    except (UrdfError, ParameterException) as error:
        get_logger('robot_state_publisher').fatal(str(error))
        return 1
    finally:
        rclpy.shutdown()
    return 0


def _spin_until(is_over: Callable[[], bool], node: Node) -> None:
    # rclpy's spin_until_future_complete keeps some memory for every callback that it runs.
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not is_over():
        executor.spin_once(timeout_sec=0.2)
