"""The motor of an emulated servo: what it is told, what it measures, what is wrong with it."""

from nodlidar_sim.world.nod_motion import ServoShaft
from nodlidar_sim.world.servo.firmware import Compliance

# Bits of the alarms, which all models share.
INPUT_VOLTAGE, OVERHEATING, OVERLOAD = 0x01, 0x04, 0x20

Target = tuple[float, float] | None
"""Goal [rad] and speed [rad/s]; None without torque."""


class Motor:
    """Drives a motion.

    Parameters
    ----------
    motion
        Of shaft and lidar.
    supply
        Voltage of the supply [V].

    Attributes
    ----------
    voltage, temperature
        Of the supply [V] and of the motor [deg C].
    load
        Torque of a further load, in units of the greatest torque; above the torque limit the motor
        is overloaded.
    """

    def __init__(self, motion: ServoShaft, supply: float) -> None:
        self.voltage, self.temperature, self.load = supply, 35.0, 0.0
        self._motion = motion
        self._target: Target = None
        self._compliance: Compliance | None = None

    def drive(self, now_ns: int, compliance: Compliance, target: Target) -> None:
        """Pass on what has changed at a time [ns]: the position loop, the target."""
        if compliance != self._compliance:
            self._compliance = compliance
            self._motion.set_compliance(now_ns, compliance)
        if target != self._target:
            self._target = target
            if target is None:
                self._motion.brake(now_ns)
            else:
                self._motion.set_goal(now_ns, *target)

    def alarms(self, voltages: tuple[int, int], hottest: int, limit: float | None) -> int:
        """Return the bits of what is wrong.

        Parameters
        ----------
        voltages, hottest
            Lowest and highest voltage [0.1 V], and highest temperature [deg C], that are allowed.
        limit
            Of the torque, as a share of the greatest; None while it is off.
        """
        alarms = 0
        if not voltages[0] <= round(self.voltage * 10.0) <= voltages[1]:
            alarms |= INPUT_VOLTAGE
        if self.temperature > hottest:
            alarms |= OVERHEATING
        if limit is not None and abs(self.load) > limit:
            alarms |= OVERLOAD
        return alarms

    def pitch(self, now_ns: int) -> float:
        """Return the pitch by the encoder [rad]."""
        return self._motion.measured(now_ns)[0]

    def velocity(self, now_ns: int) -> float:
        """Return the angular velocity of the shaft [rad/s]."""
        return self._motion.measured(now_ns)[1]

    def torque(self, now_ns: int) -> float:
        """Return the torque that is reported as the load, in units of the greatest."""
        return self.load + self._motion.load(now_ns)


def proportional(limit: float, gain: float = 1.0) -> Compliance:
    """Return a position loop without margins.

    Parameters
    ----------
    limit
        Of the torque, as a share of the greatest.
    gain
        P gain over that of the motion's parameters.
    """
    return Compliance(0.0, 1.0, 0.0, 1.0, 0.0, limit, gain)
