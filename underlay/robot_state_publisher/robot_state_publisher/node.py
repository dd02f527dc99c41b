"""The node: parameters and joint states in, transforms out."""

from collections.abc import Callable
import math
import signal

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.callback_groups import CallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from robot_state_publisher.kinematics import Joint, parse, UrdfError
from robot_state_publisher.throttle import Throttle
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# As many as may come between two looks.
_STATES = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
# Shortest interval of transforms [ns] at which looking for states is cheaper than being woken.
_LEAST_LOOK_NS = 20_000_000
_LONGEST_WAIT = 0.2  # s; then signals are noticed


class _WithoutWaking(CallbackGroup):
    """Messages wait until they are taken: most are not due, and waking up costs most."""

    def can_execute(self, entity):
        return False

    def beginning_execution(self, entity):
        return False

    def ending_execution(self, entity):
        pass


class RobotStatePublisher(Node):
    """Publishes a robot's fixed joints once and its moving joints with each joint state."""

    def __init__(self) -> None:
        super().__init__('robot_state_publisher')
        fixed = ParameterDescriptor(read_only=True)
        description = self.declare_parameter('robot_description', '', fixed).value
        frequency = self.declare_parameter('publish_frequency', 20.0, fixed).value
        # In whole milliseconds, as on Jazzy; 0 is no limit.
        self._interval_ns = int(1000.0 / frequency) * 1_000_000 if frequency else 0
        self._throttle = Throttle()
        joints = parse(description)
        self._moving = {joint.name: joint for joint in joints if joint.turns}
        self._tf = self.create_publisher(TFMessage, '/tf', 100)
        self._tf_static = self.create_publisher(TFMessage, '/tf_static', _LATCHED)
        self._description = self.create_publisher(String, 'robot_description', _LATCHED)
        self._description.publish(String(data=description))
        now = self.get_clock().now().to_msg()
        static = [_transform(joint, 0.0, now) for joint in joints if not joint.turns]
        self._tf_static.publish(TFMessage(transforms=static))
        looks = self._interval_ns >= _LEAST_LOOK_NS
        polled = {'callback_group': _WithoutWaking()} if looks else {}
        self._states = self.create_subscription(
            JointState, 'joint_states', self._joint_states_arrived, _STATES, **polled
        )
        self.look_period = min(self._interval_ns * 1e-9, _LONGEST_WAIT) if looks else _LONGEST_WAIT
        self.get_logger().info('Robot initialized')

    def look(self) -> None:
        """Take the joint states that have come; call it every `look_period` [s].

        A timer would wake the executor, which takes longer for it than for a wait that is over.
        """
        with self._states.handle:
            while taken := self._states.handle.take_message(JointState, False):
                self._joint_states_arrived(taken[0])

    def _joint_states_arrived(self, state: JointState) -> None:
        stamp = state.header.stamp
        # The time of ROS has no negative stamps, and refuses them.
        if len(state.name) != len(state.position) or stamp.sec < 0:
            self.get_logger().error('Robot state publisher ignored an invalid JointState message')
            return
        now_ns = self.get_clock().now().nanoseconds
        if self._throttle.went_back(now_ns):
            self.get_logger().warning('Moved backwards in time, re-publishing joint transforms!')
        stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        if self._throttle.due(state.name, stamp_ns, now_ns, self._interval_ns):
            positions = zip(state.name, state.position, strict=True)
            moving = [
                _transform(self._moving[name], position, stamp)
                for name, position in positions
                if name in self._moving and math.isfinite(position)
            ]
            self._tf.publish(TFMessage(transforms=moving))
            self._throttle.published(state.name, stamp_ns)


def _transform(joint: Joint, position: float, stamp: Time) -> TransformStamped:
    message = TransformStamped(child_frame_id=joint.child)
    message.header.stamp = stamp
    message.header.frame_id = joint.parent
    (x, y, z), (qw, qx, qy, qz) = joint.pose(position)
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = float(x), float(y), float(z)
    rotation.x, rotation.y, rotation.z = float(qx), float(qy), float(qz)
    rotation.w = float(qw)
    return message


def main() -> int:
    """Run the node until SIGINT or SIGTERM; return the exit status."""
    received: list[int] = []
    ending = (signal.SIGINT, signal.SIGTERM)
    for number in ending:
        signal.signal(number, lambda got, _: received.append(got))
    # rclpy's own handlers end its context in the middle of a callback, or are missed.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        _spin_until(lambda: bool(received), RobotStatePublisher())
    except (UrdfError, ParameterException) as error:
        get_logger('robot_state_publisher').fatal(str(error))
        return 1
    finally:
        for number in ending:
            signal.signal(number, signal.SIG_IGN)  # a second Ctrl-C, while Python ends
        rclpy.shutdown()
    return 0


def _spin_until(is_over: Callable[[], bool], node: RobotStatePublisher) -> None:
    # rclpy's spin_until_future_complete keeps some memory for every callback that it runs.
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not is_over():
        executor.spin_once(timeout_sec=node.look_period)
        node.look()
