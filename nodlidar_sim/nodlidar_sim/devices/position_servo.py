"""What servos that hold positions do with their registers: a goal, a speed, a limit of torque."""

from nodlidar_sim.devices.bus_servo import BusServo, Reader
from nodlidar_sim.world.motion import ServoShaft
from nodlidar_sim.world.servo.firmware import Compliance


class PositionServo(BusServo):
    """A servo that drives a motion; a `Device`.

    Parameters
    ----------
    reader, bit_rate, latency_timer
        See BusServo.
    motion
        Motion of shaft and lidar, which follows the servo's goals.
    supply
        Voltage of the supply [V].

    Attributes
    ----------
    voltage, temperature, load
        Of the supply [V] and of the motor [deg C]; torque of a further load, in units of the
        greatest torque. Above the limit of the torque the motor is overloaded.
    """

    def __init__(
        self,
        reader: Reader,
        bit_rate: float,
        latency_timer: float,
        motion: ServoShaft,
        supply: float,
    ) -> None:
        super().__init__(reader, bit_rate, latency_timer)
        self.voltage, self.temperature, self.load = supply, 35.0, 0.0
        self._motion = motion
        self._target: tuple[float, float] | None = None
        self._loop: tuple[float, float] | None = None

    def _apply(
        self, now_ns: int, limit: float, target: tuple[float, float] | None, gain: float = 1.0
    ) -> None:
        """Pass on what has changed at a time [ns].

        Parameters
        ----------
        now_ns
            The time.
        limit
            Of the torque, as a share of the greatest.
        target
            Goal [rad] and speed [rad/s]; None without torque.
        gain
            P gain over that of the motion's parameters.
        """
        if (limit, gain) != self._loop:
            self._loop = limit, gain
            self._motion.set_compliance(now_ns, Compliance(0.0, 1.0, 0.0, 1.0, 0.0, limit, gain))
        if target != self._target:
            self._target = target
            if target is None:
                self._motion.brake(now_ns)
            else:
                self._motion.set_goal(now_ns, *target)
