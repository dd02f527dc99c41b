"""The motor of an RX, AX or MX servo, controlled and reported by the registers."""

import math

from nodlidar_sim.devices.motor import Motor, Target
from nodlidar_sim.devices.registers import sign_magnitude
from nodlidar_sim.devices.rx_table import (
    CCW_MARGIN,
    CCW_SLOPE,
    ControlTable,
    CW_MARGIN,
    CW_SLOPE,
    Errors,
    GOAL,
    LOAD,
    MAX_TORQUE,
    MOVING,
    MOVING_SPEED,
    POSITION,
    PUNCH,
    RX24F,
    SHUTDOWN,
    SPEED,
    TEMPERATURE,
    TEMPERATURE_LIMIT,
    TORQUE_ENABLE,
    TORQUE_LIMIT,
    VOLTAGE,
    VOLTAGE_MAX,
    VOLTAGE_MIN,
)
from nodlidar_sim.world.nod_motion import ServoShaft
from nodlidar_sim.world.servo.firmware import Compliance

TICK = RX24F.tick
"""Angle from a position to the next [rad]."""

SPEED_UNIT = RX24F.speed_unit
"""Step of the speed registers [rad/s]."""

_VALUE_BITS = 0x3FF
_CLOCKWISE = 0x400  # sign of a speed or load
_WITHOUT_END = 1e6  # goal that is never reached in wheel mode [rad]
_TURN = 2.0 * math.pi


class RxMotor(Motor):
    """Drives the motion by the registers.

    Parameters
    ----------
    motion
        Of shaft and lidar; falling ticks are clockwise.
    table
        The registers.
    invert
        Whether rising ticks pitch down.
    """

    def __init__(self, motion: ServoShaft, table: ControlTable, invert: bool) -> None:
        super().__init__(motion, table.kind.supply)
        self._table, self._kind = table, table.kind
        self._sign = -1.0 if invert else 1.0
        table[GOAL] = self._position(0)

    def reset(self, now_ns: int) -> None:
        """Set every register to its default, and the goal to the position of the shaft."""
        self._table.reset()
        self._table[GOAL] = self._position(now_ns)

    def written(self, address: int, size: int) -> None:
        """Switch the torque on if the host wrote the goal."""
        if address < GOAL.address + GOAL.size and GOAL.address < address + size:
            self._table[TORQUE_ENABLE] = 1

    def update(self, now_ns: int, refusal: Errors) -> Errors:
        """Apply the registers at a time [ns]; return the errors of the motor and of the request.

        SHUTDOWN may also name errors of a request.
        """
        errors = refusal | self._alarms()
        if errors & self._table[SHUTDOWN]:
            self._table[TORQUE_LIMIT] = 0
        self.drive(now_ns, self._position_loop(), self._wanted())
        return errors

    def measure(self, now_ns: int) -> None:
        """Update the registers that report the state."""
        speed = self._sign * self.velocity(now_ns)
        self._table[POSITION] = self._position(now_ns)
        self._table[SPEED] = sign_magnitude(speed / self._kind.speed_unit, _CLOCKWISE)
        load = self._sign * self.torque(now_ns) * _VALUE_BITS
        self._table[LOAD] = sign_magnitude(load, _CLOCKWISE)
        self._table[MOVING] = int(abs(speed) > 1e-9)
        self._table[VOLTAGE] = round(self.voltage * 10.0)
        self._table[TEMPERATURE] = round(self.temperature)

    def _alarms(self) -> Errors:
        table = self._table
        limit = self._torque_limit / _VALUE_BITS if table[TORQUE_ENABLE] else None
        voltages = table[VOLTAGE_MIN], table[VOLTAGE_MAX]
        return Errors(self.alarms(voltages, table[TEMPERATURE_LIMIT], limit))

    @property
    def _torque_limit(self) -> int:
        return min(self._table[TORQUE_LIMIT], self._table[MAX_TORQUE])

    def _position_loop(self) -> Compliance:
        """Return the registers of the position loop; rising ticks are counter-clockwise."""
        table = self._table
        sides = [(table[CCW_MARGIN], table[CCW_SLOPE]), (table[CW_MARGIN], table[CW_SLOPE])]
        up, down = sides if self._sign > 0.0 else sides[::-1]
        return Compliance(*up, *down, table[PUNCH] / _VALUE_BITS, self._torque_limit / _VALUE_BITS)

    def _wanted(self) -> Target:
        """Return the goal [rad] and the speed [rad/s]; None without torque."""
        table = self._table
        if not table[TORQUE_ENABLE] or not self._torque_limit:
            return None
        fastest = self._kind.fastest * self.voltage / self._kind.supply
        speed = (table[MOVING_SPEED] & _VALUE_BITS) * self._kind.speed_unit
        if not table.wheel_mode:
            return self._pitch_of(table[GOAL]), min(speed or fastest, fastest)
        if speed == 0.0:
            return None
        direction = -1.0 if table[MOVING_SPEED] & _CLOCKWISE else 1.0
        return self._sign * direction * _WITHOUT_END, min(speed, fastest)

    def _pitch_of(self, tick: int) -> float:
        return self._sign * (tick - self._kind.ticks // 2) * self._kind.tick  # level in the middle

    def _position(self, now_ns: int) -> int:
        """Return the nearest tick, limited to their range; in wheel mode modulo a full turn."""
        kind = self._kind
        ticks = self._sign * self.pitch(now_ns) / kind.tick + kind.ticks // 2
        if self._table.wheel_mode:
            ticks %= _TURN / kind.tick
        return min(max(round(ticks), 0), kind.ticks - 1)
