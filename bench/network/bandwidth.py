"""What a running sensor sends: messages, bytes and packets of each topic, and its endpoints' QoS.

The serialised messages are counted by a node that subscribes to every topic. Services and actions
are left out.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
import math
from pathlib import Path
import tempfile
import time
from typing import Any

from nodlidar_bringup.ros.launched import keep_apart, launched_sensor
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from bench.shared.report import Row

DURATION, WARM_UP, PATIENCE = 20.0, 4.0, 40.0  # s
TITLE = f'Serialised messages of a sensor in the room, {DURATION:.0f} s'
# Launch file, its arguments, and level_scan of the assembler.
SETUPS = {
    'balanced': ('robot.launch.py', ['base:=odometry'], 'scan'),
    'slam': ('robot.launch.py', ['base:=odometry', 'profile:=slam'], 'sweep'),
    'slam, with the mapper': (
        'mapping.launch.py',
        ['scene:=room', 'route:=figure_of_eight'],
        'sweep',
    ),
}
PACKET = 1480  # bytes of a message in an IP packet of 1500 bytes
OWN = 'bandwidth'
BEGINS = 'points'  # messages of this topic show that the system works
UNHEARD = ('/parameter_events', '/rosout')


@dataclass(slots=True)
class Traffic:
    """The sizes of a topic's messages [bytes], those before the measurement, its publishers."""

    sizes: list[int] = field(default_factory=list)
    earlier: int = 0
    publishers: list[TopicEndpointInfo] = field(default_factory=list)


class Listener(Node):
    """Subscribes to all topics that anyone publishes, with the QoS that its publisher offers."""

    def __init__(self, context: rclpy.Context) -> None:
        super().__init__(OWN, context=context)
        self.traffic: dict[str, Traffic] = {}

    def look(self) -> None:
        """Subscribe to the topics that are new; note their publishers."""
        for topic, kinds in self.get_topic_names_and_types():
            found = publishers_of(self, topic)
            if topic in UNHEARD or '/_action/' in topic or not found:
                continue
            if topic not in self.traffic:
                self.traffic[topic] = Traffic()
                self._subscribe(topic, message_type(kinds[0]), found[0].qos_profile)
            self.traffic[topic].publishers = found

    def _subscribe(self, topic: str, kind: Any, offered: QoSProfile) -> None:
        qos = QoSProfile(
            depth=1000, reliability=offered.reliability, durability=offered.durability
        )
        sizes = self.traffic[topic].sizes
        self.create_subscription(kind, topic, lambda data: sizes.append(len(data)), qos, raw=True)


def message_type(name: str) -> Any:
    """Return the class of a message type like sensor_msgs/msg/LaserScan."""
    package, folder, kind = name.split('/')
    return getattr(import_module(f'{package}.{folder}'), kind)


def publishers_of(node: Node, topic: str) -> list[TopicEndpointInfo]:
    """Return the publishers of a topic in other nodes."""
    found = node.get_publishers_info_by_topic(topic)
    return [each for each in found if each.node_name != OWN]


def results() -> list[Row]:
    """Return the traffic of each topic, by profile."""
    keep_apart()
    return [
        {'profile': profile, **row}
        for profile, setup in SETUPS.items()
        for row in measured(*setup)
    ]


def measured(file: str, arguments: list[str], level_scan: str) -> list[Row]:
    """Return the traffic of the topics of a launch file with arguments and level scans."""
    with tempfile.TemporaryDirectory() as folder:
        parameters, log = Path(folder) / 'assembler.yaml', Path(folder) / 'launch.log'
        parameters.write_text(f"/**: {{ros__parameters: {{level_scan: '{level_scan}'}}}}\n")
        arguments = [*arguments, f'assembler_params:={parameters}']
        with launched_sensor(log, *arguments, file=file), _listener() as (node, executor):
            _spin(executor, node, PATIENCE, lambda: _works(node))
            _spin(executor, node, WARM_UP)
            for traffic in node.traffic.values():
                traffic.earlier = len(traffic.sizes)
            took = _spin(executor, node, DURATION)
            return [_row(topic, each, took) for topic, each in sorted(node.traffic.items())]


def _works(node: Listener) -> bool:
    return any(topic.endswith(BEGINS) and each.sizes for topic, each in node.traffic.items())


@contextmanager
def _listener() -> Iterator[tuple[Listener, SingleThreadedExecutor]]:
    context = rclpy.Context()
    rclpy.init(context=context)
    executor = SingleThreadedExecutor(context=context)
    node = Listener(context)
    executor.add_node(node)
    try:
        yield node, executor
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)


def _spin(
    executor: SingleThreadedExecutor, node: Listener, duration: float, ends: Any = lambda: False
) -> float:
    """Listen for a time [s], or until a condition holds; return the time [s]."""
    begin = time.monotonic()
    looked = -math.inf
    while (now := time.monotonic()) - begin < duration and not ends():
        if now - looked > 0.5:
            node.look()
            looked = now
        executor.spin_once(timeout_sec=0.05)
    return time.monotonic() - begin


def _row(topic: str, traffic: Traffic, duration: float) -> Row:
    sizes = np.array(traffic.sizes or [0])
    counted = traffic.sizes[traffic.earlier :]
    return {
        'topic': topic,
        'from': ', '.join(sorted({each.node_name for each in traffic.publishers})),
        'messages/s': len(counted) / duration,
        'size, median [kB]': float(np.median(sizes)) / 1e3,
        'size, largest [kB]': float(sizes.max()) / 1e3,
        'kB/s': sum(counted) / duration / 1e3,
        'packets of the largest': math.ceil(sizes.max() / PACKET),
        **offered(traffic.publishers),
    }


def offered(publishers: list[TopicEndpointInfo]) -> Row:
    """Return reliability and durability of publishers, in words."""
    profiles = [each.qos_profile for each in publishers]
    return {
        'reliability': _words(
            'reliable' if p.reliability == ReliabilityPolicy.RELIABLE else 'best effort'
            for p in profiles
        ),
        'durability': _words(p.durability.name.lower().replace('_', ' ') for p in profiles),
    }


def _words(values: Iterator[str]) -> str:
    return ' or '.join(sorted(set(values)))
