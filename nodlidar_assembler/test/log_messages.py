"""What a driver and a servo would publish of a sensor's log."""

from nodlidar_common.ros.messages import time_message
from sensor_msgs.msg import JointState, LaserScan


def scan_message(scan):
    geometry = scan.geometry
    message = LaserScan(
        angle_min=float(geometry.angle_min),
        angle_increment=float(geometry.angle_increment),
        time_increment=float(geometry.time_increment),
        range_min=float(geometry.range_min),
        range_max=float(geometry.range_max),
        ranges=scan.ranges,
    )
    message.header.stamp = time_message(scan.stamp_ns)
    return message


def state_message(stamp_ns, pitch):
    message = JointState(name=['wheel', 'nod_joint'], position=[9.0, float(pitch)])
    message.header.stamp = time_message(int(stamp_ns))
    return message
