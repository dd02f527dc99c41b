"""Waypoints as a ROS message."""

from collections.abc import Sequence

from builtin_interfaces.msg import Duration
from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import NS_PER_S
from nodlidar_servo.joint_trajectory.waypoints import Waypoint
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def trajectory_message(joint_name: str, waypoints: Sequence[Waypoint]) -> JointTrajectory:
    """Return the trajectory of one joint; its stamp is the time of the first waypoint."""
    begin_ns = waypoints[0].time_ns
    message = JointTrajectory(
        joint_names=[joint_name], points=[_point(each, begin_ns) for each in waypoints]
    )
    message.header.stamp = time_message(begin_ns)
    return message


def _point(waypoint: Waypoint, begin_ns: int) -> JointTrajectoryPoint:
    seconds, rest = divmod(waypoint.time_ns - begin_ns, NS_PER_S)
    return JointTrajectoryPoint(
        positions=[waypoint.pitch],
        velocities=[waypoint.velocity],
        time_from_start=Duration(sec=seconds, nanosec=rest),
    )
