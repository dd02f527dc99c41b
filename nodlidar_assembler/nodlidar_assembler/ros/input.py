"""The topics that the assembler hears: what goes wrong with a message ends nothing."""

from typing import Any

from message_filters import Subscriber
from nodlidar_assembler.publishers import Publishers
from nodlidar_common.survival import Survival
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions


class Input(Subscriber):
    """A subscription as a filter, which goes on after errors and knows what was lost.

    Parameters
    ----------
    node, kind, topic
        Of the subscription; its QoS may be overridden.
    depth
        Messages that wait while the node is busy or stopped.
    survival
        The shell around what is done with a message.

    Attributes
    ----------
    publishers
        Tells who published, and what was lost.
    publisher
        Whose message it is that is being passed on.
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
        """Pass on a message that arrived, whatever becomes of it."""
        self.publisher = self.publishers.add(info.get('publication_sequence_number'))
        with self._survival.surviving():
            super().callback(msg)
