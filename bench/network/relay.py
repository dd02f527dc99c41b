"""Two sites joined by a line: machines where there are the rights for them, otherwise domains.

The nodes of two ROS domains do not hear each other. A relay carries the sensor's messages between
them, late and with losses, as `python -m bench.network.relay ROBOT FAR LOSS DELAY JITTER`. It
needs no rights, but what it loses are messages, not packets: nothing is sent again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import heapq
from itertools import count
import os
from pathlib import Path
import signal
import sys
import tempfile
import time
from typing import Any
import warnings

from nodlidar_msgs.msg import NodCommand
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState, LaserScan

from bench.network.machines import Line, Machines, NoRightsError
from bench.network.network_rig import process_at, Result, Site

FROM_ROBOT = {'scan': LaserScan, 'joint_states': JointState}
TO_ROBOT = {'nod_command': NodCommand}
DOMAINS = 110, 120  # above those that tests take for themselves
_DEPTH = 100
_WAIT = 0.001  # s


class Here:
    """The machine of this process, as a place."""

    def run(self, function: Callable[[], Result]) -> Result:
        """Call a function."""
        return function()


@contextmanager
def joined(line: Line, environment: dict[str, str]) -> Iterator[tuple[Site, Site]]:
    """Yield the sites of the robot and of the far nodes, joined by a line; warn of a relay."""
    try:
        machines = Machines(line)
    except NoRightsError as error:
        warnings.warn(f'{error}: the line loses messages instead of packets', stacklevel=3)
        with relayed(line) as sites:
            yield sites
    else:
        with machines:
            yield Site(machines.robot, environment), Site(machines.far, environment)


@contextmanager
def relayed(line: Line) -> Iterator[tuple[Site, Site]]:
    """Yield two domains on this machine, joined by a relay."""
    own = os.getpid() % 100  # so that runs side by side rarely share a domain
    domains = [str(base + own // 10) for base in DOMAINS]
    robot, far = (Site(Here(), {'ROS_DOMAIN_ID': domain}) for domain in domains)
    numbers = [f'{value}' for value in (line.loss, line.delay, line.jitter)]
    command = [sys.executable, '-m', 'bench.network.relay', *domains, *numbers]
    with (
        tempfile.TemporaryDirectory() as folder,
        process_at(Site(Here(), {}), Path(folder) / 'relay.log', command),
    ):
        yield robot, far


class Relay:
    """Carries serialised messages between two domains.

    Parameters
    ----------
    domains
        That of the robot and the other one.
    line
        How the messages go.
    """

    def __init__(self, domains: tuple[int, int], line: Line) -> None:
        self._line, self._rng = line, np.random.default_rng(1)
        self._queue: list[tuple[float, int, Any, bytes]] = []
        self._last_due: dict[str, float] = {}
        self._number = count()
        self._contexts = [rclpy.Context() for _ in domains]
        self._executors, nodes = [], []
        for context, domain in zip(self._contexts, domains, strict=True):
            rclpy.init(
                context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO
            )
            nodes.append(rclpy.create_node('relay', context=context))
            self._executors.append(SingleThreadedExecutor(context=context))
            self._executors[-1].add_node(nodes[-1])
        for topics, (source, target) in ((FROM_ROBOT, nodes), (TO_ROBOT, nodes[::-1])):
            for topic, kind in topics.items():
                self._carry(source, target, kind, topic)

    def _carry(self, source: Any, target: Any, kind: Any, topic: str) -> None:
        publisher = target.create_publisher(kind, topic, _DEPTH)

        def accept(data: bytes) -> None:
            if self._rng.random() < self._line.loss:
                return
            due = time.monotonic() + self._line.delay + self._line.jitter * self._rng.random()
            due = self._last_due[topic] = max(due, self._last_due.get(topic, 0.0))
            heapq.heappush(self._queue, (due, next(self._number), publisher, data))

        source.create_subscription(kind, topic, accept, _DEPTH, raw=True)

    def run(self, is_over: Callable[[], bool]) -> None:
        """Carry messages until the end."""
        while not is_over():
            for executor in self._executors:
                executor.spin_once(timeout_sec=_WAIT)
            while self._queue and self._queue[0][0] <= time.monotonic():
                _, _, publisher, data = heapq.heappop(self._queue)
                publisher.publish(data)


def main() -> None:
    """Run as a program until a signal."""
    ended: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _: ended.append(got))
    robot, far, *line = sys.argv[1:]
    Relay((int(robot), int(far)), Line(*map(float, line))).run(lambda: bool(ended))


if __name__ == '__main__':
    main()
