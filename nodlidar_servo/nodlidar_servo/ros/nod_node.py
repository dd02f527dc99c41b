"""What both nodes have in common that move the joint: nod commands in, their status out."""

import time
from typing import Any

from nodlidar_common.errors import ParameterError
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.messages import nod_from_message
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import time_ns
from nodlidar_common.tracking import NodProgress
from nodlidar_msgs.msg import NodCommand, NodStatus
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.ros.messages import status_message


class NodNode(DeviceNode):
    """The node `servo`: takes `nod_command`, publishes `~/status`; a subclass moves the joint.

    Attributes
    ----------
    commands
        The nod commands; set by `configure`.
    """

    commands: NodCommands

    def __init__(self, config_class: type[Any]) -> None:
        super().__init__('servo', config_class)
        self._status = self.create_lifecycle_publisher(
            NodStatus, '~/status', 10, qos_overriding_options=OVERRIDABLE
        )
        self.sole_topic = self.create_subscription(
            NodCommand, 'nod_command', self._on_command, 10, qos_overriding_options=OVERRIDABLE
        ).topic_name

    def now_ns(self) -> int:
        """Return the time of the clock by which nods are commanded [ns]."""
        return time.time_ns()

    def start_clock_ns(self) -> int:
        """Return the time of the clock by which nods start [ns]."""
        return steady_ns()

    def publish_status(self, progress: NodProgress | None) -> None:
        """Publish the status; no progress if the joint does not follow a nod."""
        self._status.publish(status_message(progress, self.now_ns(), self.config))

    def _on_command(self, message: NodCommand) -> None:
        """Accept a command, or refuse it, and log what is new in that."""
        clock_ns = self.start_clock_ns()
        try:
            start_ns = clock_ns + time_ns(message.start_time) - self.now_ns()
            self.commands.accept(nod_from_message(message), steady_ns(), start_ns, clock_ns)
        except ParameterError as error:
            if self.commands.refuse(error, steady_ns()):
                self.get_logger().error(f'nod command refused: {error}')
