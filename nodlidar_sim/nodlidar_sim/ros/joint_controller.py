"""The topics of a joint of ros2_control: trajectories in, joint states out."""

from collections.abc import Callable, Sequence
from contextlib import suppress

from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.stamps import time_ns
from nodlidar_sim.devices.controlled_joint import ControlledJoint
from nodlidar_sim.devices.trajectory_controller import Trajectory, TrajectoryError
import numpy as np
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

_DEPTH = 10  # of the default quality of service, which the controllers have


class JointController:
    """Lets a node take the trajectories of a joint, and publish its states as `joint_states`.

    Parameters
    ----------
    node
        The node.
    joint
        The joint, which another thread serves: that publishes.
    names
        Of the controller, in the node's namespace, and of the joint.
    clock
        Returns the host time of the simulation [ns].
    """

    def __init__(
        self, node: Node, joint: ControlledJoint, names: tuple[str, str], clock: Callable[[], int]
    ) -> None:
        self._node, self._controller, self._clock = node, joint.controller, clock
        controller, self._name = names
        self._states = node.create_publisher(
            JointState, 'joint_states', _DEPTH, qos_overriding_options=OVERRIDABLE
        )
        node.create_subscription(
            JointTrajectory,
            f'{controller}/joint_trajectory',
            self._take,
            _DEPTH,
            qos_overriding_options=OVERRIDABLE,
        )
        joint.publish = self._publish

    def _take(self, message: JointTrajectory) -> None:
        try:
            self._controller.accept(trajectory_of(message, [self._name]), self._clock())
        except TrajectoryError as error:
            text = f'trajectory refused: {error}'
            self._node.get_logger().error(text, throttle_duration_sec=1.0)

    def _publish(self, stamp_ns: int, position: float, velocity: float) -> None:
        message = JointState(name=[self._name], position=[position], velocity=[velocity])
        message.header.stamp = time_message(stamp_ns)
        with suppress(InvalidHandle):  # the node ends before the thread
            self._states.publish(message)


def trajectory_of(message: JointTrajectory, joints: Sequence[str]) -> Trajectory:
    """Return the trajectory of the last one of the joints of a controller.

    Raises
    ------
    TrajectoryError
        If the controller refuses the message for its joints, or for values that are missing; also
        for values that it would take, and then command NaN or, without velocities, 0 rad.
    """
    if set(message.joint_names) != set(joints) or len(message.joint_names) != len(joints):
        raise TrajectoryError(f'its joints are not {", ".join(joints)}')
    index = message.joint_names.index(joints[-1])
    return Trajectory(
        time_ns(message.header.stamp),
        np.array([time_ns(point.time_from_start) for point in message.points], dtype=np.int64),
        np.array([_state(point, index, len(joints)) for point in message.points]),
    )


def _state(point: JointTrajectoryPoint, index: int, joints: int) -> list[float]:
    fields = point.positions, point.velocities, point.accelerations
    if len(point.positions) != joints or any(len(each) not in (0, joints) for each in fields):
        raise TrajectoryError('a point lacks a value of a joint')
    if point.effort:
        raise TrajectoryError('it has an effort, which the joint does not take')
    if not all(np.isfinite(each[index]) for each in fields if each):
        raise TrajectoryError('a value is not finite')
    if point.accelerations and not point.velocities:
        raise TrajectoryError('a point has an acceleration without a velocity')
    return [each[index] if each else np.nan for each in fields]
