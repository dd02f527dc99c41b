"""A Dynamixel of the X series at byte level: Protocol 2.0, its control table and its motor.

Profile velocity only: a profile acceleration other than 0 is not emulated, nor are operating modes
other than position control.
"""

from __future__ import annotations

import math

from nodlidar_sim.devices import x_table as table
from nodlidar_sim.devices.bus_servo import BusServo, data_for
from nodlidar_sim.devices.dynamixel_packets import BROADCAST, Instruction
from nodlidar_sim.devices.dynamixel_packets_2 import InstructionReader, status_packet
from nodlidar_sim.devices.motor import Motor, proportional, Target
from nodlidar_sim.world.nod_motion import ServoShaft

PING, READ, WRITE, REBOOT, SYNC_READ, SYNC_WRITE = 1, 2, 3, 8, 0x82, 0x83
BIT_RATES = (9600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
TICK = math.radians(360.0) / 4096
SPEED_UNIT = 0.229 * 2.0 * math.pi / 60.0

_DELAY_UNIT_NS = 2_000
_PING_STEP_NS = 3_000_000  # between answers of two IDs to a ping of all, as the SDK expects
_OVERHEAD = 11  # bytes of an answer without data
_ZERO_TICK = 2048  # at pitch 0


class XServoEmulator(BusServo):
    """The servo, its bus and its USB adapter as the host sees them; a `Device`.

    Parameters
    ----------
    motion
        Motion of shaft and lidar, which follows the servo's goals.
    kind
        An XL430-W250, or another servo with its table.
    servo_id, baud, return_delay
        Initial values of these registers; the factory settings are 1, 1 (57600 bit/s) and 250.
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
        kind: table.XKind = table.XL430,
        servo_id: int = table.ID.default,
        baud: int = table.BAUD.default,
        return_delay: int = table.RETURN_DELAY.default,
        latency_timer: float = 0.0,
    ) -> None:
        self.table = table.XTable(kind)
        self.table[table.ID], self.table[table.BAUD] = servo_id, baud
        self.table[table.RETURN_DELAY] = return_delay
        self._kind = kind
        self._heard_ns = 0
        self.motor = Motor(motion, kind.supply)
        super().__init__(InstructionReader(), self.bit_rate, latency_timer)

    @property
    def bit_rate(self) -> float:
        """Bit rate of the servo [bit/s]."""
        return BIT_RATES[self.table[table.BAUD]]

    def transmit(self, now_ns: int) -> bytes:
        """Remove and return the bytes that have reached the host by a time [ns]."""
        self._watch(now_ns)
        return super().transmit(now_ns)

    def next_event_ns(self) -> int | None:
        """Return when a reply reaches the host or the watchdog expires [ns], None if never."""
        events = [each for each in (super().next_event_ns(), self._expires_ns()) if each]
        return min(events, default=None)

    def _expires_ns(self) -> int | None:
        """Return when the bus watchdog stops the motor unless an instruction comes [ns]."""
        units = self.table[table.WATCHDOG]
        if units in (0, table.EXPIRED):
            return None
        return self._heard_ns + units * table.WATCHDOG_UNIT_NS

    def _watch(self, now_ns: int) -> None:
        expires_ns = self._expires_ns()
        if expires_ns is not None and now_ns >= expires_ns:
            self.table[table.WATCHDOG] = table.EXPIRED
            self._update(expires_ns)

    @property
    def _has_expired(self) -> bool:
        return self.table[table.WATCHDOG] == table.EXPIRED

    def _handle(self, instruction: Instruction, at_ns: int) -> None:
        self._watch(at_ns)
        self._heard_ns = at_ns
        own_id, answered = self.table[table.ID], self._answers(instruction)
        answer_ns = at_ns + self.table[table.RETURN_DELAY] * _DELAY_UNIT_NS
        if instruction.servo_id not in (own_id, BROADCAST):
            return
        error, data = table.CRC_ERROR, b''
        if instruction.sound:
            error, data = self._execute(instruction, at_ns)
        self._update(at_ns)
        if answered:
            answer_ns += self._turn_ns(instruction, own_id)
            alert = table.ALERT if self.table[table.HARDWARE_ERROR] else 0
            self._wire.send(status_packet(own_id, error | alert, data), answer_ns)

    def _answers(self, instruction: Instruction) -> bool:
        """Return whether an instruction is answered: by the return level; a ping always is."""
        least = {PING: 0, READ: 1}.get(instruction.code, 2) if instruction.sound else 2
        if instruction.servo_id == BROADCAST:
            is_read = instruction.code == SYNC_READ and self._is_asked(instruction)
            return least == 0 or (is_read and self.table[table.RETURN_LEVEL] >= 1)
        return self.table[table.RETURN_LEVEL] >= least

    def _is_asked(self, instruction: Instruction) -> bool:
        """Return whether a sync read (address, size, IDs) asks this servo."""
        return self.table[table.ID] in instruction.parameters[4:]

    def _turn_ns(self, instruction: Instruction, own_id: int) -> int:
        """Return how long after the first of several servos this one answers [ns]."""
        if instruction.servo_id != BROADCAST or not instruction.sound:
            return 0
        if instruction.code == PING:
            return own_id * _PING_STEP_NS
        size = int.from_bytes(instruction.parameters[2:4], 'little') + _OVERHEAD
        before = instruction.parameters.index(own_id, 4) - 4
        delay_ns = self.table[table.RETURN_DELAY] * _DELAY_UNIT_NS
        return before * (self._wire.duration_ns(size) + delay_ns)

    def _execute(self, instruction: Instruction, at_ns: int) -> tuple[int, bytes]:
        """Execute a packet with the right CRC; return error number and data of the answer."""
        code, parameters = instruction.code, instruction.parameters
        address = int.from_bytes(parameters[:2], 'little')
        if (code == READ and len(parameters) == 4) or (
            code == SYNC_READ and self._is_asked(instruction)
        ):
            self._measure(at_ns)
            data = self.table.read(address, int.from_bytes(parameters[2:4], 'little'))
            return (table.DATA_RANGE, b'') if data is None else (0, data)
        if code == PING and not parameters:
            model = self.table.read(table.MODEL.address, 2) or b''
            return 0, model + bytes([self.table[table.FIRMWARE]])
        if code == WRITE and len(parameters) > 2:
            return self._write(address, parameters[2:]), b''
        if code == SYNC_WRITE and instruction.servo_id == BROADCAST and len(parameters) > 4:
            return self._sync_write(address, parameters), b''
        if code == REBOOT and not parameters:
            self.table.reset(table.EEPROM_END)
            return 0, b''
        return table.INSTRUCTION_ERROR, b''

    def _write(self, address: int, data: bytes) -> int:
        """Write registers; a motor with a hardware error keeps its torque off."""
        if address == table.TORQUE_ENABLE.address and any(data) and self._is_shut_down:
            return table.DATA_RANGE
        ends = address + len(data)
        if self._has_expired and any(address <= each.address < ends for each in table.GOALS):
            return table.DATA_RANGE
        return self.table.write(address, data)

    def _sync_write(self, address: int, parameters: bytes) -> int:
        """Write this servo's part of: address, size, then ID and data of each servo."""
        size = int.from_bytes(parameters[2:4], 'little')
        data = data_for(self.table[table.ID], parameters[4:], size)
        return 0 if data is None else self._write(address, data)

    @property
    def _is_shut_down(self) -> bool:
        return bool(self.table[table.HARDWARE_ERROR] & self.table[table.SHUTDOWN])

    def _update(self, now_ns: int) -> None:
        """Apply the registers at a time [ns]."""
        registers = self.table
        registers[table.HARDWARE_ERROR] |= self._alarms()
        if self._is_shut_down:
            registers[table.TORQUE_ENABLE] = 0
        loop = proportional(self._torque_limit, registers[table.P_GAIN] / self._kind.gain)
        self.motor.drive(now_ns, loop, self._wanted())

    @property
    def _torque_limit(self) -> float:
        return self.table[table.GOAL_PWM] / table.PWM_LIMIT.default

    def _alarms(self) -> int:
        registers = self.table
        voltages = registers[table.VOLTAGE_MIN], registers[table.VOLTAGE_MAX]
        limit = self._torque_limit if registers[table.TORQUE_ENABLE] else None
        return self.motor.alarms(voltages, registers[table.TEMPERATURE_LIMIT], limit)

    def _wanted(self) -> Target:
        """Return the goal [rad] and the speed [rad/s]; None without torque."""
        registers = self.table
        if not registers[table.TORQUE_ENABLE] or self._has_expired:
            return None
        fastest = self._kind.fastest * self.motor.voltage / self._kind.supply
        speed = registers[table.PROFILE_VELOCITY] * SPEED_UNIT
        goal = (registers[table.GOAL] - _ZERO_TICK) * TICK
        return goal, min(speed or fastest, fastest)

    def _measure(self, now_ns: int) -> None:
        """Update the registers that report the state."""
        registers, motor = self.table, self.motor
        speed = motor.velocity(now_ns)
        registers[table.POSITION] = round(motor.pitch(now_ns) / TICK + _ZERO_TICK)
        registers[table.VELOCITY] = round(speed / SPEED_UNIT)
        registers[table.LOAD] = round(motor.torque(now_ns) * self._kind.load_unit)
        registers[table.MOVING] = int(abs(speed) > 1e-9)
        registers[table.VOLTAGE] = round(motor.voltage * 10.0)
        registers[table.TEMPERATURE] = round(motor.temperature)
