"""The control table of a Feetech STS3215: registers, defaults, limits.

Addresses, sizes and signs by Feetech's SCServo library (SMS_STS.h) and LeRobot's tables for
Feetech, which agree. What a write does that is out of its range is not documented: here it is
ignored.
"""

from nodlidar_sim.devices.registers import Register, Registers

SIZE = 71
EEPROM_END = 40
LAST_TICK = 4095
STS3215_MODEL = 777

FIRMWARE = Register(0, 1, 3)
MODEL = Register(3, 2, STS3215_MODEL)
ID = Register(5, 1, 1, 0, 253)
BAUD = Register(6, 1, 0, 0, 7)
RETURN_DELAY = Register(7, 1, 0, 0, 254)
RETURN_LEVEL = Register(8, 1, 1, 0, 1)
MIN_POSITION = Register(9, 2, 0, 0, 0xFFFF)
MAX_POSITION = Register(11, 2, LAST_TICK, 0, 0xFFFF)
TEMPERATURE_LIMIT = Register(13, 1, 70, 0, 100)
VOLTAGE_MAX = Register(14, 1, 140, 0, 254)
VOLTAGE_MIN = Register(15, 1, 40, 0, 254)
MAX_TORQUE = Register(16, 2, 1000, 0, 1000)
UNLOADING = Register(19, 1, 44, 0, 254)
P_GAIN = Register(21, 1, 32, 0, 254)
MODE = Register(33, 1, 0, 0, 3)
TORQUE_ENABLE = Register(40, 1, 0, 0, 1)
ACCELERATION = Register(41, 1, 0, 0, 254)
GOAL = Register(42, 2, 0, 0, 0xFFFF)
GOAL_TIME = Register(44, 2, 0, 0, 0xFFFF)
GOAL_SPEED = Register(46, 2, 0, 0, 0x7FFF)
TORQUE_LIMIT = Register(48, 2, 1000, 0, 1000)
LOCK = Register(55, 1, 1, 0, 1)
POSITION = Register(56, 2, 0)
SPEED = Register(58, 2, 0)
LOAD = Register(60, 2, 0)
VOLTAGE = Register(62, 1, 0)
TEMPERATURE = Register(63, 1, 0)
STATUS = Register(65, 1, 0)
MOVING = Register(66, 1, 0)

REGISTERS = tuple(value for value in list(globals().values()) if isinstance(value, Register))

SIGN, LOAD_SIGN = 0x8000, 0x400


class StsTable(Registers):
    """The bytes of the table; the rules for writing apply to the host, not to the servo.

    While LOCK is 1, what is written to the EEPROM is lost when the supply is switched off.
    """

    def __init__(self) -> None:
        super().__init__(REGISTERS, SIZE)
        self._saved = bytes(self._bytes[:EEPROM_END])

    def write(self, address: int, data: bytes) -> None:
        """Write whole registers if all are allowed."""
        touched = self.touched(address, len(data))
        if sum(r.size for r in touched) != len(data) or any(r.high is None for r in touched):
            return
        before = bytes(self._bytes)
        self._bytes[address : address + len(data)] = data
        if not all(r.low <= self[r] <= (r.high or 0) for r in touched):
            self._bytes[:] = before
        elif address < EEPROM_END and not self[LOCK]:
            self._saved = bytes(self._bytes[:EEPROM_END])

    def save(self) -> None:
        """Save the EEPROM as it is, as after delivery."""
        self._saved = bytes(self._bytes[:EEPROM_END])

    def power_up(self) -> None:
        """Set the RAM to its defaults and the EEPROM to what was saved."""
        self.reset()
        self._bytes[:EEPROM_END] = self._saved
