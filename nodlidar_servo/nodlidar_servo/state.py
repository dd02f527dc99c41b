"""What the device's thread passes on to the diagnostics and the status."""

from dataclasses import dataclass

from nodlidar_servo.sample import Sample
from nodlidar_servo.servo import Limits
from nodlidar_servo.servo_loop import LoopFigures
from nodlidar_servo.tracking import Progress


@dataclass(frozen=True, slots=True)
class Link:
    """A connected servo.

    Attributes
    ----------
    connected_ns
        Time of the connection [ns].
    limits
        The motor's own limits.
    latency_warning
        Why the adapter is slow; empty if it is not.
    torque
        Whether the torque is on, or not confirmed to be off.
    shut_down
        The status bits for which the motor has cut its torque.
    sample
        The latest sample; None before the first one.
    """

    connected_ns: int
    limits: Limits
    latency_warning: str
    torque: bool
    shut_down: int
    sample: Sample | None


@dataclass(frozen=True, slots=True)
class ServoState:
    """The servo and its cycles so far.

    Attributes
    ----------
    figures
        Counts over all connections.
    link
        The connected servo; None without one.
    progress
        How the nod is followed; None without a nod command.
    fault
        Why the servo does not follow; empty if it does.
    """

    figures: LoopFigures
    link: Link | None = None
    progress: Progress | None = None
    fault: str = ''
