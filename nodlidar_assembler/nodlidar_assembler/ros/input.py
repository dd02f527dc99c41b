"""Subscriptions of the assembler that continue after errors."""

from collections.abc import Callable
from typing import Any

from message_filters import Subscriber
from nodlidar_assembler.inputs.one_source import OneSource
from nodlidar_common.publishers import Publishers
from nodlidar_common.ros.polled import taken, WhenWanted
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.survival import Survival
from rclpy.node import Node


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
    **options
        Of the subscription.

    Attributes
    ----------
    publishers
        Publishers and losses of the topic.
    publisher, arrived_ns
        Publisher of the message that is being passed on, and the host's time of its arrival [ns];
        0 if unknown.
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        depth: int,
        survival: Survival,
        **options: Any,
    ) -> None:
        self.publishers, self.publisher, self.arrived_ns = Publishers(), 0, 0
        self._survival = survival
        super().__init__(
            node,
            kind,
            topic,
            qos_profile=depth,
            qos_overriding_options=OVERRIDABLE,
            **options,
        )

    def callback(self, msg: Any, info: dict[str, int]) -> None:
        """Pass on a message; catch errors."""
        self.publisher = self.publishers.add(info.get('publication_sequence_number'))
        self.arrived_ns = info.get('received_timestamp', 0)
        with self._survival.surviving():
            super().callback(msg)


class SingleInput(Input):
    """An input from one publisher; messages of a second one are dropped as long as it sends.

    Attributes
    ----------
    of_others
        Number of messages of other publishers.
    """

    def __init__(self, *args: Any) -> None:
        self.of_others = 0
        self._source = OneSource()
        super().__init__(*args)

    def signalMessage(self, *args: Any) -> None:  # noqa: N802, of message_filters
        """Pass on a message, unless it is of another publisher."""
        if self.publisher and not self._source.admits(self.publisher, steady_ns()):
            self.of_others += 1
        else:
            super().signalMessage(*args)


class PolledInput(Input):
    """An input whose messages wait until they are taken; they wake the node only if wanted.

    Parameters
    ----------
    node, kind, topic, depth, survival
        See Input.
    wanted
        Returns whether the next message is wanted at once.
    on_wake
        Called before a message that woke the node is passed on.
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        topic: str,
        depth: int,
        survival: Survival,
        wanted: Callable[[], bool],
        on_wake: Callable[[], None],
    ) -> None:
        self._on_wake = on_wake
        group = WhenWanted(wanted)
        super().__init__(node, kind, topic, depth, survival, callback_group=group)

    def callback(self, msg: Any, info: dict[str, int]) -> None:
        """Pass on a message that woke the node."""
        self._on_wake()
        super().callback(msg, info)

    def take(self) -> None:
        """Pass on the messages that wait, the oldest first."""
        for message, info in taken(self.sub):
            super().callback(message, info)
