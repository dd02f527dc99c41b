"""A Feetech STS3215 at byte level: packets of Dynamixel Protocol 1.0, its own table, its motor.

An acceleration other than 0 is not emulated, nor are operating modes other than position control.
How a motor that has shut itself down is revived is a guess: by any write to its torque switch.
"""

import math

from nodlidar_sim.devices import sts_table as table
from nodlidar_sim.devices.bus_servo import BusServo, data_for
from nodlidar_sim.devices.dynamixel_packets import (
    BROADCAST,
    Instruction,
    InstructionReader,
    status_packet,
)
from nodlidar_sim.devices.motor import Motor, proportional, Target
from nodlidar_sim.devices.registers import sign_magnitude
from nodlidar_sim.world.nod_motion import ServoShaft

PING, READ, WRITE, SYNC_WRITE = 1, 2, 3, 0x83
BIT_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
TICK = math.radians(360.0) / 4096

_DELAY_UNIT_NS = 2_000
_ZERO_TICK = 2048  # at pitch 0
_LOAD_UNIT = 1000
_FULL_TORQUE = 1000
_SUPPLY = 7.4  # V
_FASTEST = 45.0 * 2.0 * math.pi / 60.0  # without load [rad/s]


class StsEmulator(BusServo):
    """The servo, its bus and its USB adapter as the host sees them; a `Device`.

    Parameters
    ----------
    motion
        Motion of shaft and lidar, which follows the servo's goals.
    servo_id, baud, return_delay
        Initial values of these registers; the factory settings are 1, 0 (1 Mbit/s) and 0.
    latency_timer
        Of the USB adapter [s].

    Attributes
    ----------
    motor
        The motor; tests inject faults there.
    table
        The registers.
    """

    def __init__(
        self,
        motion: ServoShaft,
        *,
        servo_id: int = table.ID.default,
        baud: int = table.BAUD.default,
        return_delay: int = table.RETURN_DELAY.default,
        latency_timer: float = 0.0,
    ) -> None:
        self.table = table.StsTable()
        self.table[table.ID], self.table[table.BAUD] = servo_id, baud
        self.table[table.RETURN_DELAY] = return_delay
        self.table.save()
        self.motor = Motor(motion, _SUPPLY)
        super().__init__(InstructionReader(), self.bit_rate, latency_timer)

    @property
    def bit_rate(self) -> float:
        """Bit rate of the servo [bit/s]."""
        return BIT_RATES[self.table[table.BAUD]]

    def _handle(self, instruction: Instruction, at_ns: int) -> None:
        """Execute a packet at the time at which it was complete, and answer it."""
        own_id, answered = self.table[table.ID], self._answers(instruction)
        answer_ns = at_ns + self.table[table.RETURN_DELAY] * _DELAY_UNIT_NS
        if instruction.servo_id not in (own_id, BROADCAST) or not instruction.sound:
            return
        data = self._execute(instruction, at_ns)
        self._update(at_ns)
        if answered:
            self._wire.send(status_packet(own_id, self.table[table.STATUS], data), answer_ns)

    def _answers(self, instruction: Instruction) -> bool:
        """Return whether an instruction is answered: pings and reads always are."""
        if instruction.servo_id == BROADCAST:
            return instruction.code == PING
        return instruction.code in (PING, READ) or bool(self.table[table.RETURN_LEVEL])

    def _execute(self, instruction: Instruction, at_ns: int) -> bytes:
        """Execute a packet with the right checksum; return the data of the answer."""
        code, parameters = instruction.code, instruction.parameters
        if code == READ and len(parameters) == 2:
            self._measure(at_ns)
            return self.table.read(*parameters) or b''
        if code == WRITE and len(parameters) > 1:
            self.table.write(parameters[0], parameters[1:])
            if parameters[0] == table.TORQUE_ENABLE.address:
                self.table[table.STATUS] = 0
        if code == SYNC_WRITE and instruction.servo_id == BROADCAST and len(parameters) > 2:
            self._sync_write(parameters)
        return b''

    def _sync_write(self, parameters: bytes) -> None:
        """Write this servo's part of: address, size, then ID and data of each servo."""
        data = data_for(self.table[table.ID], parameters[2:], parameters[1])
        if data is not None:
            self.table.write(parameters[0], data)

    def _update(self, now_ns: int) -> None:
        """Apply the registers at a time [ns]."""
        registers = self.table
        shut_down = registers[table.STATUS] & registers[table.UNLOADING]
        registers[table.STATUS] = shut_down | self._alarms()
        if registers[table.STATUS] & registers[table.UNLOADING]:
            registers[table.TORQUE_ENABLE] = 0
        self.motor.drive(now_ns, proportional(self._torque_limit), self._wanted())

    @property
    def _torque_limit(self) -> float:
        return min(self.table[table.TORQUE_LIMIT], self.table[table.MAX_TORQUE]) / _FULL_TORQUE

    def _alarms(self) -> int:
        registers = self.table
        voltages = registers[table.VOLTAGE_MIN], registers[table.VOLTAGE_MAX]
        limit = self._torque_limit if registers[table.TORQUE_ENABLE] else None
        return self.motor.alarms(voltages, registers[table.TEMPERATURE_LIMIT], limit)

    def _wanted(self) -> Target:
        """Return the goal [rad] and the speed [rad/s]; None without torque."""
        registers = self.table
        if not registers[table.TORQUE_ENABLE] or registers[table.MODE]:
            return None
        fastest = _FASTEST * self.motor.voltage / _SUPPLY
        speed = registers[table.GOAL_SPEED] * TICK
        low, high = registers[table.MIN_POSITION], registers[table.MAX_POSITION]
        goal = min(max(registers[table.GOAL], low), high)
        return (goal - _ZERO_TICK) * TICK, min(speed or fastest, fastest)

    def _measure(self, now_ns: int) -> None:
        """Update the registers that report the state."""
        registers, motor = self.table, self.motor
        speed = motor.velocity(now_ns)
        ticks = round(motor.pitch(now_ns) / TICK + _ZERO_TICK)
        load = motor.torque(now_ns) * _LOAD_UNIT
        registers[table.POSITION] = ticks % (table.LAST_TICK + 1)
        registers[table.SPEED] = sign_magnitude(speed / TICK, table.SIGN)
        registers[table.LOAD] = sign_magnitude(load, table.LOAD_SIGN)
        registers[table.MOVING] = int(abs(speed) > 1e-9)
        registers[table.VOLTAGE] = round(motor.voltage * 10.0)
        registers[table.TEMPERATURE] = round(motor.temperature)
