"""The topics of the running sensor, recorded for some time."""

import time

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.calibration.recorded import Recorder
from nodlidar_assembler.config import AssemblerConfig
import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState, LaserScan


def record(config: AssemblerConfig, scan: str, joint_states: str, seconds: float) -> SensorLog:
    """Return the log of two topics over a time [s]; raises CalibrationError if one is silent."""
    recorder = Recorder(config)
    rclpy.init()
    try:
        node = rclpy.create_node('calibrate')

        def add_scan(message: LaserScan) -> None:
            recorder.add_scan(message, node.get_clock().now().nanoseconds)

        for kind, topic, add in (
            (LaserScan, scan, add_scan),
            (JointState, joint_states, recorder.add_joint_state),
        ):
            node.create_subscription(kind, topic, add, qos_profile_sensor_data)
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            rclpy.spin_once(node, timeout_sec=left)
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    return recorder.log()
