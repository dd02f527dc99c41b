"""What the device's thread passes on to the diagnostics and the status."""

from dataclasses import dataclass

from nodlidar_common.tracking import NodProgress
from nodlidar_servo.device.preparation import MotorLimits
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.servo_loop import LoopFigures


@dataclass(frozen=True, slots=True)
class Link:
    """A connected servo."""

    limits: MotorLimits
    torque: bool  # on, or not confirmed to be off
    shut_down: int  # status bits for which the motor has cut its torque

    @classmethod
    def of(cls, servo: Servo) -> 'Link':
        """Return the present link to a servo."""
        return cls(servo.limits, servo.torque, servo.shut_down)


@dataclass(frozen=True, slots=True)
class ServoState:
    """The servo and its cycles so far; counts are over all connections."""

    figures: LoopFigures  # a copy that nobody changes
    link: Link | None = None  # None while not connected
    latency_warning: str = ''
    sample: Sample | None = None  # the latest of this connection, believed or not
    progress: NodProgress | None = None  # None without a nod command
    fault: str = ''  # why the servo does not follow
