"""The topics of the running sensor, recorded for some time."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields, replace
import sys
import time
from typing import Any

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.calibration.recorded import Recorder
from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryError, Poses
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.ros.tf_odometry import TfOdometry
from nodlidar_common.survival import Survival
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState, LaserScan

ANSWER = 4.0  # s, until the running assembler is found: Fast DDS announces itself every 3 s


def record(
    config: AssemblerConfig | None, scan: str, joint_states: str, seconds: float
) -> tuple[SensorLog, AssemblerConfig]:
    """Return the log of two topics over a time [s], and the parameters of the assembler.

    The log has the odometry that TF has in that time, if any.

    Parameters
    ----------
    config
        These parameters; None for those of the assembler that hears the scans.
    scan, joint_states
        The topics.
    seconds
        How long they are recorded.

    Raises
    ------
    CalibrationError
        If one of the topics is silent.
    """
    rclpy.init()
    try:
        node = rclpy.create_node('calibrate')
        config = config or running_config(node, scan)
        recorder = Recorder(config)
        poses: list[tuple[int, Sequence[float], Sequence[float]]] = []
        odometry = TfOdometry(
            node,
            config.odom_frame,
            config.frame_id,
            lambda *pose: poses.append(pose),
            poses.clear,
            Survival(node.get_logger().error),
            period=config.odometry_period,
        )

        def add_scan(message: LaserScan) -> None:
            odometry.take()
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
    return replace(recorder.log(), odometry=_odometry(poses)), config


def _odometry(poses: list[tuple[int, Sequence[float], Sequence[float]]]) -> Odometry | None:
    with suppress(OdometryError):
        if poses:
            times_ns, places, turns = (np.array(each) for each in zip(*poses, strict=True))
            return Odometry(times_ns, Poses(places, turns))
    return None


def running_config(node: Node, scan: str) -> AssemblerConfig:
    """Return the parameters of the assembler that hears a topic.

    If there is none, they are the defaults, and a line on stderr says so.
    """
    topic, end = node.resolve_topic_name(scan), time.monotonic() + ANSWER
    while time.monotonic() < end:
        for info in node.get_subscriptions_info_by_topic(topic):
            if info.node_name == 'assembler':
                full = f'{info.node_namespace.rstrip("/")}/{info.node_name}'
                values = _values(node, full, end)
                if values:
                    return AssemblerConfig(**values)
        rclpy.spin_once(node, timeout_sec=0.1)
    print(f"no assembler hears '{topic}': calibrating its defaults", file=sys.stderr)
    return AssemblerConfig()


def _values(node: Node, assembler: str, end: float) -> dict[str, Any]:
    """Return the parameters of a node; none if it has not answered at some time [s]."""
    defaults = AssemblerConfig()
    names = [each.name for each in fields(defaults)]
    client = AsyncParameterClient(node, assembler)
    if not client.wait_for_services(max(end - time.monotonic(), 0.0)):
        return {}
    answer = client.get_parameters(names)
    rclpy.spin_until_future_complete(node, answer, timeout_sec=max(end - time.monotonic(), 0.0))
    given = answer.result().values if answer.done() else ()
    values = dict(zip(names, map(parameter_value_to_python, given), strict=False))
    lists = {name for name in values if isinstance(getattr(defaults, name), tuple)}
    return {name: tuple(v) if name in lists else v for name, v in values.items()}
