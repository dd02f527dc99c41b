"""The transforms that a page listens to."""

import gc

from nodlidar_viewer.ros.transforms import Transforms
import rclpy
from rclpy.time import Time


def test_one_page_after_the_other_may_listen_with_the_clock_of_a_node():
    """A clock that calls a page which is gone ends the process."""
    rclpy.init()
    node = rclpy.create_node('viewer')
    clock = node.get_clock()
    clock._set_ros_time_is_active(True)
    clock.set_ros_time_override(Time(seconds=100, clock_type=clock.clock_type))
    for second in range(99, 69, -1):
        Transforms(node).end()
        gc.collect()  # what is made next may lie where the last one was
        clock.set_ros_time_override(Time(seconds=second, clock_type=clock.clock_type))
    assert clock.now().nanoseconds == 70 * 10**9
    node.destroy_node()
    rclpy.shutdown()
