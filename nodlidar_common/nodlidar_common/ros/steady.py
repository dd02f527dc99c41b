"""Time that goes on evenly when the host's clock is set: what keeps a machine going runs on it."""

from collections.abc import Callable
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node


def steady_ns() -> int:
    """Return the steady clock's time [ns]; only differences mean something."""
    return time.monotonic_ns()


def create_steady_timer(node: Node, period: float, callback: Callable[[], Any]) -> Any:
    """Return a timer of a node that keeps its period [s] by the steady clock.

    A timer on the node's own clock stops for as long as the host's clock was set back, and with
    simulated time whenever the simulation pauses.
    """
    return node.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))
