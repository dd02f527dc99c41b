"""Time and timers that a step of the host's clock does not affect."""

from collections.abc import Callable
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node


def steady_ns() -> int:
    """Return the steady clock's time [ns]; only differences are meaningful."""
    return time.monotonic_ns()


def create_steady_timer(node: Node, period: float, callback: Callable[[], Any]) -> Any:
    """Return a timer of a node with a period [s] of the steady clock.

    After the host's clock was set back, a timer on the node's own clock stops for as long as the
    step; with simulated time it stops while the simulation pauses.
    """
    return node.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
