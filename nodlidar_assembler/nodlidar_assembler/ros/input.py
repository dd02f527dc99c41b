"""Subscriptions of the assembler that continue after errors."""

from typing import Any

from message_filters import Subscriber
from nodlidar_assembler.inputs.publishers import Publishers
from nodlidar_common.survival import Survival
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions


class Input(Subscriber):
    """A subscription as a filter, which continues after errors and counts lost messages.

    Parameters
    ----------
    node, kind, topic
        Node, message type and topic; the QoS may be overridden.
    depth
        Messages that wait while the node is busy or stopped.
    survival
        Catches errors of the callbacks.

    Attributes
    ----------
    publishers
        Publishers and losses of the topic.
    publisher
        Publisher of the message that is being passed on.
    """

    def __init__(self, node: Node, kind: Any, topic: str, depth: int, survival: Survival) -> None:
        self.publishers, self.publisher = Publishers(), 0
        self._survival = survival
        super().__init__(
            node,
            kind,
            topic,
            qos_profile=QoSProfile(depth=depth),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def callback(self, msg: Any, info: dict[str, int]) -> None:
        """Pass on a message; catch errors."""
        self.publisher = self.publishers.add(info.get('publication_sequence_number'))
        with self._survival.surviving():
            super().callback(msg)
