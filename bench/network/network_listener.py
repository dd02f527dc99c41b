"""A node that writes down what arrives: `python -m bench.network.network_listener FILE TOPIC...`.

Each topic is NAME=TYPE, or NAME=TYPE=best_effort.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
import pickle
import sys
from typing import Any, BinaryIO

from nodlidar_common.ros.node import run
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from bench.network.bandwidth import message_type


@dataclass(frozen=True, slots=True)
class Arrival:
    """A message: when it was published and when it arrived [ns], by the clock of the host."""

    topic: str
    kind: str
    published_ns: int
    arrived_ns: int
    data: bytes

    def message(self) -> Any:
        """Return the message."""
        return deserialize_message(self.data, message_type(self.kind))


class NetworkListener(Node):
    """Writes the serialised messages of topics into a file, as they arrive."""

    def __init__(self, file: BinaryIO, topics: list[str]) -> None:
        super().__init__('listener')
        self._file = file
        for topic in topics:
            self._listen(*topic.split('='))

    def _listen(self, topic: str, kind: str, reliability: str = 'reliable') -> None:
        def write(data: bytes, info: dict[str, int]) -> None:
            published_ns, arrived_ns = info['source_timestamp'], info['received_timestamp']
            pickle.dump((topic, kind, published_ns, arrived_ns, bytes(data)), self._file)
            self._file.flush()

        qos = QoSProfile(depth=100, reliability=ReliabilityPolicy[reliability.upper()])
        self.create_subscription(message_type(kind), topic, write, qos, raw=True)


def arrivals(path: Path) -> Iterator[Arrival]:
    """Yield the messages in a file, which may still grow."""
    if not path.exists():
        return
    with path.open('rb') as file:
        while True:
            try:
                yield Arrival(*pickle.load(file))
            except (EOFError, pickle.UnpicklingError):
                return


if __name__ == '__main__':
    with open(sys.argv[1], 'wb') as output:
        sys.exit(run(lambda: NetworkListener(output, sys.argv[2:])))
