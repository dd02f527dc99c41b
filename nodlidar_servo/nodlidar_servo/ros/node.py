"""The lifecycle node of the servo: nod commands in, joint states out."""

import sys
import time

from nodlidar_common.host_time import HostTime
from nodlidar_common.ros.node import run
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S
from nodlidar_servo.bus.latency import reduce_latency
from nodlidar_servo.bus.reply_timeout import LONGEST_REPLY
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.device.torque_off import torque_off
from nodlidar_servo.diagnosis import Diagnosis
from nodlidar_servo.following import Following
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.ros.messages import fill_joint_state, joint_state_template
from nodlidar_servo.ros.nod_node import NodNode
from nodlidar_servo.servo_loop import LoopFigures, ServoLoop
from sensor_msgs.msg import JointState

_DEPTH = 1000  # joint states kept for a reliable subscriber that pauses for some seconds
STATUS_PERIOD = 0.2  # s
# s; for this long a sample waits for later ones, and all are published at once: what a message
# costs is mostly that processes wake up for it, here and where it arrives.
LONGEST_HELD = 0.012


class ServoNode(NodNode):
    """Follows `nod_command`; publishes `joint_states` and `~/status`."""

    def __init__(self) -> None:
        super().__init__(ServoConfig)
        self._host_time = HostTime()
        self.configure()
        self._servo: Servo | None = None
        self._joint_states = self.create_lifecycle_publisher(
            JointState, 'joint_states', _DEPTH, qos_overriding_options=OVERRIDABLE
        )
        self._status_ns = 0

    def configure(self) -> None:
        """Restart the counts, and forget all commands: the limits may have changed."""
        self.commands = NodCommands(self.config)
        self._figures = LoopFigures()
        self._following = Following(self.config)
        self._fault_logged = ''
        self.diagnosis: Diagnosis = Diagnosis(
            self._figures, self.commands, self._following, self.config.feedback_rate
        )
        self._message = joint_state_template(self.config.joint_name)
        self._samples: list[Sample] = []
        self._together = 1 + int(LONGEST_HELD * self.config.feedback_rate)

    def _publish_status(self) -> None:
        now_ns, state = steady_ns(), self.diagnosis.state
        if now_ns - self._status_ns >= STATUS_PERIOD * NS_PER_S and state.link is not None:
            self._status_ns = now_ns
            self.publish_status(None if state.fault else state.progress)

    def connect(self) -> None:
        """Open the port and set the servo up."""
        port = self.thread.open_port(
            LONGEST_REPLY, torque_off(self.config.servo_id, self.config.scale.model.table)
        )
        warning = reduce_latency(port)
        if warning:
            self.get_logger().warning(warning)
        self._servo = Servo(port, self.config, self._host_time)
        self._servo.connect()
        self.diagnosis.connected(self._servo, warning)
        self._loop = ServoLoop(
            self._servo,
            self.commands,
            self._following,
            self.config.feedback_rate,
            self._figures,
            self._host_time,
            lambda duration_ns: time.sleep(duration_ns / NS_PER_S),
            steady_ns,
        )

    def cycle(self) -> None:
        """Measure and steer once, and publish what was measured."""
        if step_ns := self._host_time.update():
            self.get_logger().warning(f"the host's clock was set by {step_ns / NS_PER_S:.3f} s")
        samples = self._loop.cycle()
        self._samples += samples
        if not samples or len(self._samples) >= self._together:
            self.diagnosis.cycled(self._loop.sample, self._loop.progress)
            self._publish_samples()
            self._publish_status()
        if self._following.fault != self._fault_logged:
            self._log_fault(self._following.fault)

    def _log_fault(self, fault: str) -> None:
        self._fault_logged = fault
        if fault:
            self.get_logger().error(fault)
        else:
            over = 'follows again' if self._loop.progress else 'has no nod command any more'
            self.get_logger().info(f'the servo {over}')

    def _publish_samples(self) -> None:
        for sample in self._samples:
            fill_joint_state(self._message, sample)
            self._joint_states.publish(self._message)
        self._samples.clear()

    def disconnect(self) -> None:
        """Publish what was measured, and switch the torque off."""
        self._publish_samples()
        servo, self._servo = self._servo, None
        self._following.rest()
        try:
            if servo is not None:
                servo.disconnect()
        finally:
            self.diagnosis.disconnected()


def main() -> None:
    """Run the servo node."""
    sys.exit(run(ServoNode))
