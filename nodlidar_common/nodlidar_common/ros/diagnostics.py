"""Diagnostics of a node: on the steady clock, under its full name, changes at once."""

from collections.abc import Callable
from typing import Any

from diagnostic_updater import Updater
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from rclpy.node import Node

CHECK_PERIOD = 0.2  # s, between two checks whether the state has changed


class SteadyUpdater(Updater):
    """A diagnostic_updater.Updater that runs on the steady clock.

    Updater's own timer is on the node's clock, which may be set or stand still. Statuses are named
    after the node with its namespace, `left/assembler: clouds`, so that those of two sensors
    differ.

    Parameters
    ----------
    node
        The node that is diagnosed.
    hardware_id
        Hardware ID of every status.
    state
        Returns a value of which every change is published at once, within CHECK_PERIOD.
    """

    def __init__(self, node: Node, hardware_id: str, state: Callable[[], object]) -> None:
        super().__init__(node)
        self.setHardwareID(hardware_id)
        self.node_name = node.get_fully_qualified_name().lstrip('/')
        self._state, self._published = state, state()
        self._published_ns = steady_ns()
        node.destroy_timer(self.timer)
        self.timer: Any = create_steady_timer(node, min(CHECK_PERIOD, self.period), self._check)

    def check(self) -> None:
        """Check whether the state has changed; the timer does it after CHECK_PERIOD again.

        A node that is awake anyway calls it, since waking up costs more than the check.
        """
        self.timer.reset()
        self._check()

    def update(self) -> None:
        """Run every task and publish the statuses."""
        self._published, self._published_ns = self._state(), steady_ns()
        super().update()

    def _check(self) -> None:
        # Half a check early rather than half a check late.
        due = steady_ns() - self._published_ns >= (self.period - CHECK_PERIOD / 2) * 1e9
        if due or self._state() != self._published:
            self.update()
