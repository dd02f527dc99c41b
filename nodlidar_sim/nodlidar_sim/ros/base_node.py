"""The node of the simulated base: publishes odometry, receives velocity commands."""

from collections.abc import Callable
import math

from geometry_msgs.msg import Quaternion, TransformStamped, Twist
from nav_msgs.msg import Odometry
from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.ros.messages import time_message
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import create_steady_timer
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.commanded import CommandedBase
from nodlidar_sim.world.odometry import Odometer
from nodlidar_sim.world.odometry_uncertainty import OdometryUncertainty
from nodlidar_sim.world.planar import motion_of, relative
import numpy as np
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import TimeReference
from tf2_ros import TransformBroadcaster

ODOM, BASE = 'odom', 'base_link'
PERIOD = 0.02  # of the odometry [s]
# Variance of quantities that wheels do not measure: height, roll and pitch [m², rad², per s²].
UNKNOWN = 1e6


class BaseNode(Node):
    """Publishes odometry, as `odom` and as the transform from odom to base_link.

    Parameters
    ----------
    odometer
        Samples the pose every PERIOD.
    uncertainty
        Computes the covariances of the messages from the motion.
    clock
        Returns the host time of the simulation [ns].
    is_running
        Returns whether the simulation is running; if not, the node has failed.
    commanded
        The base driven by `cmd_vel`; without it, the topic is not subscribed.
    """

    def __init__(
        self,
        odometer: Odometer,
        uncertainty: OdometryUncertainty,
        clock: Callable[[], int],
        is_running: Callable[[], bool] = lambda: True,
        commanded: CommandedBase | None = None,
    ) -> None:
        super().__init__('base')
        self.failed = False
        self._odometer, self._uncertainty = odometer, uncertainty
        self._host_time, self._is_running = clock, is_running
        self._last_ns = clock()
        self._last_pose = odometer.poses(np.array([self._last_ns]))
        # Odometry counts from the start of the simulation, which was before this node.
        elapsed = (self._last_ns - odometer.start_ns) / NS_PER_S
        uncertainty.add(0.0, motion_of(self._last_pose)[0], elapsed)
        self._publisher = self.create_publisher(
            Odometry, 'odom', 50, qos_overriding_options=OVERRIDABLE
        )
        self._broadcaster = TransformBroadcaster(self)
        self._publish_start(odometer.start_ns)
        if commanded is not None:
            self._commanded = commanded
            self.create_subscription(
                Twist, 'cmd_vel', self._drive, 10, qos_overriding_options=OVERRIDABLE
            )
        create_steady_timer(self, PERIOD, self.sample)

    def _publish_start(self, start_ns: int) -> None:
        """Publish when base and objects left their start; the scene then implies their poses."""
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._start = self.create_publisher(TimeReference, '~/start', latched)
        message = TimeReference(source='simulation')
        message.header.stamp = time_message(start_ns)
        self._start.publish(message)

    def sample(self) -> None:
        """Publish the odometry at the current instant."""
        self.failed = not self._is_running()
        now_ns = self._host_time()
        if now_ns <= self._last_ns:
            return
        pose = self._odometer.poses(np.array([now_ns]))
        motion = motion_of(relative(self._last_pose, pose))[0]
        elapsed = (now_ns - self._last_ns) / NS_PER_S
        velocity = motion / elapsed
        self._uncertainty.add(self._last_pose[0, 2], motion, elapsed)
        self._last_ns, self._last_pose = now_ns, pose
        message = odometry_message(now_ns, pose[0], velocity)
        message.pose.covariance = covariance(self._uncertainty.of_pose)
        message.twist.covariance = covariance(self._uncertainty.of_velocity(velocity))
        self._publisher.publish(message)
        self._broadcaster.sendTransform(transform_of(message))

    def _drive(self, message: Twist) -> None:
        try:
            self._commanded.drive((message.linear.x, message.angular.z), self._host_time())
        except ParameterError as error:
            self.get_logger().error(f'cmd_vel ignored: {error}', throttle_duration_sec=1.0)


def odometry_message(stamp_ns: int, pose: Array, velocity: Array) -> Odometry:
    """Return the message of a pose x, y, yaw in odom, and a velocity in the frame of base_link."""
    message = Odometry(child_frame_id=BASE)
    message.header.frame_id, message.header.stamp = ODOM, time_message(stamp_ns)
    x, y, yaw = map(float, pose)
    place, twist = message.pose.pose, message.twist.twist
    place.position.x, place.position.y = x, y
    place.orientation = Quaternion(z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))
    twist.linear.x, twist.linear.y, twist.angular.z = map(float, velocity)
    return message


def covariance(planar: Array) -> list[float]:
    """Return the covariance of x, y, z, roll, pitch, yaw (36,) from that of x, y, yaw (3, 3)."""
    whole = UNKNOWN * np.eye(6)
    whole[np.ix_([0, 1, 5], [0, 1, 5])] = planar
    return [float(value) for value in whole.ravel()]


def transform_of(message: Odometry) -> TransformStamped:
    """Return the transform of an odometry message."""
    transform = TransformStamped(header=message.header, child_frame_id=message.child_frame_id)
    place = message.pose.pose
    transform.transform.translation.x = place.position.x
    transform.transform.translation.y = place.position.y
    transform.transform.rotation = place.orientation
    return transform
