"""The executor of the nodes."""

from types import SimpleNamespace
from typing import Any

from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S
from rclpy.context import Context
from rclpy.event_handler import EventHandler
from rclpy.executors import SingleThreadedExecutor

# In place of the guard condition by which a callback tells other threads that it has ended.
_SILENT = SimpleNamespace(trigger=lambda: None)


class Executor(SingleThreadedExecutor):
    """Runs the callbacks of a node; looks at its QoS events, which are warnings, once a second.

    Each topic has two of them. Looked at whenever the node wakes up, they take as long as all else
    that rclpy does then. Waited for, they end the wait at once, over and over, while messages of
    their topic wait to be taken. Nor does the end of a callback wake the node for nothing.
    """

    _guard: Any

    def __init__(self, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._looks_at_events, self._next_look_ns = True, 0

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for a callback and run it; once a second, do not wait."""
        now_ns = steady_ns()
        self._looks_at_events = now_ns >= self._next_look_ns
        if self._looks_at_events:
            self._next_look_ns = now_ns + NS_PER_S
            timeout_sec = 0.0
        super().spin_once(timeout_sec)

    def can_execute(self, entity: Any) -> bool:
        """Return whether an entity may wake the node."""
        if not self._looks_at_events and isinstance(entity, EventHandler):
            return False
        return bool(super().can_execute(entity))

    def _make_handler(self, *arguments: Any) -> Any:
        """Return the task that runs a callback."""
        guard, self._guard = self._guard, _SILENT
        try:
            return super()._make_handler(*arguments)
        finally:
            self._guard = guard
