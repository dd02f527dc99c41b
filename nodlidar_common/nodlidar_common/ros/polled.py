"""Subscriptions that are asked for messages, instead of waking the node with each."""

from collections.abc import Callable, Iterator
from copy import copy
from typing import Any

from nodlidar_common.ros.qos import OVERRIDABLE
from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import EventHandler
from rclpy.node import Node
from rclpy.qos import QoSProfile


class WhenWanted(CallbackGroup):
    """Lets messages wake the node only while they are wanted; else they wait in the middleware.

    Parameters
    ----------
    wanted
        Returns whether the next message is wanted at once; called before the executor waits.
    """

    def __init__(self, wanted: Callable[[], bool] = lambda: False) -> None:
        super().__init__()
        self._wanted = wanted

    def can_execute(self, entity: Any) -> bool:
        """Return whether an entity may wake the node: a message if wanted, a QoS event always."""
        return isinstance(entity, EventHandler) or self._wanted()

    def beginning_execution(self, entity: Any) -> bool:
        """Return True: a message that woke the node is passed on."""
        return True

    def ending_execution(self, entity: Any) -> None:
        """Do nothing."""


def taken(subscription: Any) -> Iterator[tuple[Any, dict[str, int]]]:
    """Take the messages that wait; yield each, the oldest first, with its MessageInfo."""
    with subscription.handle:
        while message := subscription.handle.take_message(subscription.msg_type, subscription.raw):
            yield message


class PolledSubscription:
    """Keeps the latest messages of a topic, as many as the QoS has depth, until they are taken.

    A picture ten times per second needs joint states at 100 Hz not one by one.
    """

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        self._node = node
        self._subscription = node.create_subscription(
            message_type,
            topic,
            lambda message: None,
            copy(qos),  # overriding changes it
            callback_group=WhenWanted(),
            qos_overriding_options=OVERRIDABLE,
        )

    def take(self) -> list[Any]:
        """Return the messages that came since the last call, the oldest first."""
        return [message for message, _ in taken(self._subscription)]

    def take_with_arrival(self) -> list[tuple[Any, int]]:
        """Return the same, each with the time [ns] when it came; 0 if that is not known."""
        return [
            (message, info.get('received_timestamp', 0))
            for message, info in taken(self._subscription)
        ]

    def end(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)
