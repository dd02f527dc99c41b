"""Subscriptions that are asked for messages, instead of waking the node with each."""

from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile


class _Never(CallbackGroup):
    """Lets the executor leave its subscriptions alone."""

    def can_execute(self, entity: Any) -> bool:
        """Return False: nothing is to be executed."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Return False."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Do nothing."""


class PolledSubscription:
    """Keeps the latest messages of a topic, as many as the QoS has depth, until they are taken.

    A picture ten times per second needs joint states at 100 Hz not one by one.
    """

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        self._node = node
        self._subscription = node.create_subscription(
            message_type, topic, lambda message: None, qos, callback_group=_Never()
        )

    def take(self) -> list[Any]:
        """Return the messages that came since the last call, the oldest first."""
        messages: list[Any] = []
        with self._subscription.handle:
            while True:
                taken = self._subscription.handle.take_message(
                    self._subscription.msg_type, self._subscription.raw
                )
                if taken is None:
                    return messages
                messages.append(taken[0])

    def end(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)
