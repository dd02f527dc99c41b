"""A Dynamixel of the RX, AX or MX series at byte level: Protocol 1.0, control table and motor."""

from nodlidar_sim.devices.bus_servo import BusServo, data_for
from nodlidar_sim.devices.dynamixel_packets import (
    BROADCAST,
    Instruction,
    InstructionReader,
    status_packet,
)
from nodlidar_sim.devices.rx_motor import RxMotor
from nodlidar_sim.devices.rx_table import (
    BAUD,
    ControlTable,
    Errors,
    ID,
    REGISTERED,
    RETURN_DELAY,
    RETURN_LEVEL,
    RX24F,
    RxKind,
)
from nodlidar_sim.world.nod_motion import ServoShaft

PING, READ, WRITE, REG_WRITE, ACTION, RESET, SYNC_WRITE = 1, 2, 3, 4, 5, 6, 0x83

_DELAY_UNIT_NS = 2_000
_FASTEST_BIT_RATE = 2_000_000


class RxServoEmulator(BusServo):
    """The servo, its bus and its USB adapter as the host sees them; a `Device`.

    Parameters
    ----------
    motion
        Motion of shaft and lidar, which follows the servo's goals.
    kind
        An RX-24F, or another servo with its table.
    servo_id, baud, return_delay
        Initial values of these registers. The bit rate is 2 Mbit/s / (baud + 1), by default that
        of the factory; the unit of the delay is 2 us. The other factory settings are 1 and 250.
    latency_timer
        Of the USB adapter, which delivers replies at multiples of it [s]; 0 for at once.
    invert
        Whether rising ticks pitch down.

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
        kind: RxKind = RX24F,
        servo_id: int = ID.default,
        baud: int | None = None,
        return_delay: int = RETURN_DELAY.default,
        latency_timer: float = 0.0,
        invert: bool = False,
    ) -> None:
        self.table = ControlTable(kind)
        self.table[ID], self.table[RETURN_DELAY] = servo_id, return_delay
        if baud is not None:
            self.table[BAUD] = baud
        self.motor = RxMotor(motion, self.table, invert)
        super().__init__(InstructionReader(), self.bit_rate, latency_timer)
        self._registered: bytes | None = None

    @property
    def bit_rate(self) -> float:
        """Bit rate of the servo [bit/s]."""
        return _FASTEST_BIT_RATE / (self.table[BAUD] + 1)

    def _handle(self, instruction: Instruction, at_ns: int) -> None:
        """Execute a packet at the time at which it was complete, and answer it."""
        own_id, answered = self.table[ID], self._answers(instruction)
        answer_ns = at_ns + self.table[RETURN_DELAY] * _DELAY_UNIT_NS
        if instruction.servo_id not in (own_id, BROADCAST):
            return
        errors, data = Errors.CHECKSUM, b''
        if instruction.sound:
            errors, data = self._execute(instruction, at_ns)
        errors = self.motor.update(at_ns, errors)
        if answered:
            self._wire.send(status_packet(own_id, errors, data), answer_ns)

    def _answers(self, instruction: Instruction) -> bool:
        """Return whether an instruction is answered: by the return level; a ping always is.

        Of broadcasts, only pings are answered (ROBOTIS, RX-28 and RX-64 manuals, section 4-4).
        """
        least = {PING: 0, READ: 1}.get(instruction.code, 2) if instruction.sound else 2
        if instruction.servo_id == BROADCAST:
            return least == 0
        return self.table[RETURN_LEVEL] >= least

    def _execute(self, instruction: Instruction, at_ns: int) -> tuple[Errors, bytes]:
        """Execute a packet with the right checksum; return errors and data of the answer."""
        code, parameters = instruction.code, instruction.parameters
        if code == READ and len(parameters) == 2:
            return self._read(parameters[0], parameters[1], at_ns)
        if code == PING and not parameters:
            return Errors.NONE, b''
        if code == WRITE and len(parameters) > 1:
            return self._write(parameters), b''
        if code == REG_WRITE and len(parameters) > 1:
            return self._register(parameters), b''
        if code == ACTION and not parameters and self._registered is not None:
            return self._act(self._registered), b''
        if code == RESET and not parameters:
            self.motor.reset(at_ns)
            return Errors.NONE, b''
        if code == SYNC_WRITE and instruction.servo_id == BROADCAST:
            return self._sync_write(parameters), b''
        return Errors.INSTRUCTION, b''

    def _read(self, address: int, size: int, at_ns: int) -> tuple[Errors, bytes]:
        self.motor.measure(at_ns)
        data = self.table.read(address, size)
        return (Errors.RANGE, b'') if data is None else (Errors.NONE, data)

    def _write(self, parameters: bytes) -> Errors:
        errors = self.table.write(parameters[0], parameters[1:])
        if not errors:
            self.motor.written(parameters[0], len(parameters) - 1)
        return errors

    def _register(self, parameters: bytes) -> Errors:
        errors = self.table.errors_of(parameters[0], parameters[1:])
        if not errors:
            self._registered, self.table[REGISTERED] = parameters, 1
        return errors

    def _act(self, registered: bytes) -> Errors:
        self._registered, self.table[REGISTERED] = None, 0
        return self._write(registered)

    def _sync_write(self, parameters: bytes) -> Errors:
        """Write this servo's part of: address, size, then ID and data of each servo."""
        if len(parameters) < 2:
            return Errors.INSTRUCTION
        data = data_for(self.table[ID], parameters[2:], parameters[1])
        return Errors.NONE if data is None else self._write(parameters[:1] + data)
