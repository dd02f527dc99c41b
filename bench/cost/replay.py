"""The callbacks of the real assembler node, called with the messages of a log."""

from functools import partial
import time

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_assembler.ros.node import AssemblerNode
from nodlidar_bringup.ros.launched import keep_apart
from nodlidar_common.ros.messages import time_message
from nodlidar_common.stamps import NS_PER_S
import numpy as np
import rclpy
from rclpy.logging import LoggingSeverity
from sensor_msgs.msg import JointState, LaserScan

# Time of arrival [ns] and message.
Timed = tuple[int, LaserScan | JointState]


def times_per_scan(
    replays: dict[str, tuple[list[str], list[Timed]]], rounds: int
) -> dict[str, float]:
    """Return the time in callbacks per scan by name [s]: the median of rounds through all replays.

    Parameters
    ----------
    replays
        By name, parameters of the node as ``name:=value``, and messages.
    rounds
        Number of rounds.
    """
    keep_apart()
    times = [[_replayed(*replay) for replay in replays.values()] for _ in range(rounds)]
    return dict(zip(replays, np.median(times, axis=0).tolist(), strict=True))


def _replayed(parameters: list[str], messages: list[Timed]) -> float:
    """Call a node's callbacks with messages; return the time that all take per scan [s].

    Its timers are called as often as in real time.
    """
    given = [word for parameter in parameters for word in ('-p', parameter)]
    rclpy.init(args=['--ros-args', *given])
    node = AssemblerNode()
    node.get_logger().set_level(LoggingSeverity.ERROR)
    callbacks = {s.msg_type: s.callback for s in node.subscriptions}
    info: dict[str, int] = {}  # of the middleware about a message
    calls = [(at_ns, partial(callbacks[type(m)], m, info)) for at_ns, m in messages]
    for timer in node.timers:
        calls += [(at_ns, timer.callback) for at_ns in _ticks(messages, timer.timer_period_ns)]
    calls.sort(key=lambda call: call[0])
    begin = time.thread_time()
    for _, call in calls:
        call()
    took = time.thread_time() - begin
    # The level of a name stays for the whole process.
    node.get_logger().set_level(LoggingSeverity.UNSET)
    node.destroy_node()
    rclpy.shutdown()
    return took / sum(isinstance(message, LaserScan) for _, message in messages)


def _ticks(messages: list[Timed], period_ns: int) -> range:
    return range(messages[0][0] + period_ns, messages[-1][0], period_ns)


def messages_of(log: SensorLog) -> list[Timed]:
    """Return scans, each after its last beam, and joint states in the order of their time."""
    timed: list[Timed] = []
    for scan in log.scans:
        geometry = scan.geometry
        message = LaserScan(
            angle_min=geometry.angle_min,
            angle_increment=geometry.angle_increment,
            time_increment=geometry.time_increment,
            range_min=geometry.range_min,
            range_max=geometry.range_max,
            ranges=scan.ranges,
            intensities=[] if scan.intensities is None else scan.intensities,
        )
        message.header.stamp = time_message(scan.stamp_ns)
        timed.append((scan.stamp_ns + NS_PER_S // 15, message))
    for stamp_ns, pitch in zip(log.sample_ns, log.sample_pitch, strict=True):
        state = JointState(name=['nod_joint'], position=[float(pitch)])
        state.header.stamp = time_message(int(stamp_ns))
        timed.append((int(stamp_ns), state))
    return sorted(timed, key=lambda entry: entry[0])
