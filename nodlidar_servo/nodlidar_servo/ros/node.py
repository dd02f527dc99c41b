"""The node of the servo: nod commands in, joint states out."""

import sys
import time

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from nodlidar_common.errors import ParameterError
from nodlidar_common.host_time import HostTime
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.device_node import DeviceNode
from nodlidar_common.ros.messages import nod_from_message
from nodlidar_common.ros.node import run
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from nodlidar_common.serial_port import close_port, open_port
from nodlidar_common.stamps import time_ns
from nodlidar_msgs.msg import NodCommand, NodStatus
from nodlidar_servo.config import ServoConfig
from nodlidar_servo.diagnosis import Diagnosis
from nodlidar_servo.following import Following
from nodlidar_servo.latency import reduce_latency
from nodlidar_servo.nod_commands import NodCommands
from nodlidar_servo.reply_timeout import LONGEST
from nodlidar_servo.ros.nod_status import status_message
from nodlidar_servo.sample import Sample
from nodlidar_servo.servo import Servo
from nodlidar_servo.servo_loop import LoopFigures, ServoLoop
from nodlidar_servo.torque_off import torque_off
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
import serial

STATUS_PERIOD = 0.2  # s


class ServoNode(DeviceNode):
    """Follows `nod_command`, publishes `joint_states` and tells how well it follows."""

    def __init__(self) -> None:
        super().__init__('servo', ServoConfig)
        self.configure()
        self._host_time = HostTime()
        self._port: serial.Serial | None = None
        self._servo: Servo | None = None
        overriding = QoSOverridingOptions.with_default_policies()
        self._joint_states = self.create_lifecycle_publisher(
            JointState, 'joint_states', QoSProfile(depth=50), qos_overriding_options=overriding
        )
        self._status = self.create_lifecycle_publisher(
            NodStatus, '~/status', QoSProfile(depth=10), qos_overriding_options=overriding
        )
        create_steady_timer(self, STATUS_PERIOD, self._tell_status)
        self._command_topic = self.create_subscription(
            NodCommand,
            'nod_command',
            self._on_command,
            QoSProfile(depth=10),
            qos_overriding_options=overriding,
        ).topic_name

    def configure(self) -> None:
        """Begin to count, and forget the commands so far: the limits may be others."""
        self._commands = NodCommands(self.config)
        self._figures = LoopFigures()
        self._following = Following(self.config)
        self._fault_told = ''
        self._diagnosis = Diagnosis(
            self._figures, self._commands, self._following, self.config.feedback_rate
        )
        self._message = JointState(
            name=[self.config.joint_name], position=[0.0], velocity=[0.0], effort=[0.0]
        )

    def _on_command(self, message: NodCommand) -> None:
        now_ns = steady_ns()
        try:
            start_ns = now_ns + time_ns(message.start_time) - time.time_ns()
            self._commands.accept(nod_from_message(message), now_ns, start_ns)
        except ParameterError as error:
            if self._commands.refuse(error):
                self.get_logger().error(f'nod command refused: {error}')

    def _tell_status(self) -> None:
        if self._servo is not None:
            tracker = self._commands.tracker(steady_ns())
            following = None if self._following.fault else tracker
            self._status.publish(status_message(following, time.time_ns()))

    def connect(self) -> None:
        """Open the port and set the servo up."""
        self._port = open_port(self.config.port, self.config.baud_rate, LONGEST)
        self.guard(self._port.fileno(), torque_off(self.config.servo_id))
        warning = reduce_latency(self._port)
        if warning:
            self.get_logger().warning(warning)
        self._servo = Servo(self._port, self.config, self._host_time)
        self._diagnosis.connected(self._servo, warning)
        self._loop = ServoLoop(
            self._servo,
            self._commands,
            self._following,
            self.config.feedback_rate,
            self._figures,
            self._host_time,
            lambda duration_ns: time.sleep(duration_ns / NS_PER_S),
            steady_ns,
        )

    def cycle(self) -> None:
        """Measure and steer once, and publish what was measured."""
        if step_ns := self._host_time.look():
            self.get_logger().warning(f"the host's clock was set by {step_ns / NS_PER_S:.3f} s")
        for sample in self._loop.cycle():
            self._diagnosis.sample = sample
            self._publish(sample)
        if self._following.fault != self._fault_told:
            self._fault_told = self._following.fault
            self.get_logger().error(self._fault_told or 'the servo follows again')

    def _publish(self, sample: Sample) -> None:
        message = self._message
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(sample.stamp_ns, NS_PER_S)
        message.position[0] = sample.pitch
        message.velocity[0] = sample.velocity
        message.effort[0] = sample.load
        self._joint_states.publish(message)

    def disconnect(self) -> None:
        """Switch the torque off and close the port, as far as that is possible."""
        if self._servo is not None and not self._servo.release():
            self.get_logger().error('the servo did not confirm that its torque is off')
        if self._port is not None:
            close_port(self._port)
        self._diagnosis.disconnected()
        self._following.rest()
        self._port = self._servo = None

    def urgent(self) -> object:
        """Return what of the servo is told at once."""
        return self._diagnosis.urgent(steady_ns())

    def diagnose(self, status: DiagnosticStatusWrapper) -> None:
        """Add the servo's figures, and a warning or error for what is out of order."""
        commanders = self.count_publishers(self._command_topic)
        figures, warnings, errors = self._diagnosis.report(steady_ns(), commanders)
        for key, value in figures.items():
            status.add(key, value)
        for level, texts in ((DiagnosticStatus.WARN, warnings), (DiagnosticStatus.ERROR, errors)):
            for text in texts:
                status.mergeSummary(level, text)


def main() -> None:
    """Run the servo node."""
    sys.exit(run(ServoNode))
