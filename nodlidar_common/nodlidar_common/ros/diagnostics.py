"""The diagnostics of a node: on the steady clock, by the node's whole name, changes at once."""

from collections.abc import Callable
from typing import Any

from diagnostic_updater import Updater
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from rclpy.node import Node

LOOK_PERIOD = 0.2  # s, between two looks whether the state is another


class SteadyUpdater(Updater):
    """A diagnostic_updater.Updater whose updates the host's clock cannot stop.

    Updater's own timer is on the node's clock. Statuses are named after the node with its
    namespace, `left/assembler: clouds`, so that those of two sensors differ.

    Parameters
    ----------
    node
        Whose diagnostics these are.
    hardware_id
        Of every status.
    state
        Gives what is told at once, within LOOK_PERIOD, when it is another than at the last update.
    """

    def __init__(
        self, node: Node, hardware_id: str, state: Callable[[], object] = lambda: None
    ) -> None:
        super().__init__(node)
        self.setHardwareID(hardware_id)
        self.node_name = node.get_fully_qualified_name().lstrip('/')
        self._state, self._told = state, state()
        self._told_ns = steady_ns()
        node.destroy_timer(self.timer)
        self.timer: Any = create_steady_timer(node, min(LOOK_PERIOD, self.period), self._look)

    def update(self) -> None:
        """Run every task and publish the statuses."""
        self._told, self._told_ns = self._state(), steady_ns()
        super().update()

    def _look(self) -> None:
        # Half a look early rather than half a look late.
        due = steady_ns() - self._told_ns >= (self.period - LOOK_PERIOD / 2) * 1e9
        if due or self._state() != self._told:
            self.update()
