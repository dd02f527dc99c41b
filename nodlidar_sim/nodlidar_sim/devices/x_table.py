"""The control table of an X-series servo: registers, defaults, limits (e-manual, XL430-W250)."""

from dataclasses import dataclass, replace

from nodlidar_sim.devices.registers import Kind, Register, Registers

SIZE = 147
EEPROM_END = 64
LAST_TICK = 4095

MODEL = Register(0, 2, 1060)
FIRMWARE = Register(6, 1, 45)
ID = Register(7, 1, 1, 0, 252)
BAUD = Register(8, 1, 1, 0, 7)
RETURN_DELAY = Register(9, 1, 250, 0, 254)
DRIVE_MODE = Register(10, 1, 0, 0, 13)
OPERATING_MODE = Register(11, 1, 3, 0, 16)
TEMPERATURE_LIMIT = Register(31, 1, 72, 0, 100)
VOLTAGE_MAX = Register(32, 2, 140, 60, 140)
VOLTAGE_MIN = Register(34, 2, 60, 60, 140)
PWM_LIMIT = Register(36, 2, 885, 0, 885)
VELOCITY_LIMIT = Register(44, 4, 265, 0, 1023)
MAX_POSITION = Register(48, 4, LAST_TICK, 0, LAST_TICK)
MIN_POSITION = Register(52, 4, 0, 0, LAST_TICK)
SHUTDOWN = Register(63, 1, 52, 0, 61)
TORQUE_ENABLE = Register(64, 1, 0, 0, 1)
LED = Register(65, 1, 0, 0, 1)
RETURN_LEVEL = Register(68, 1, 2, 0, 2)
HARDWARE_ERROR = Register(70, 1, 0)
P_GAIN = Register(84, 2, 640, 0, 16383)
WATCHDOG = Register(98, 1, 0, 0, 127)
GOAL_PWM = Register(100, 2, 885, 0, 885)
PROFILE_ACCELERATION = Register(108, 4, 0, 0, 32767)
PROFILE_VELOCITY = Register(112, 4, 0, 0, 32767)
GOAL = Register(116, 4, 0, 0, LAST_TICK)
MOVING = Register(122, 1, 0)
LOAD = Register(126, 2, 0)
VELOCITY = Register(128, 4, 0)
POSITION = Register(132, 4, 0)
VOLTAGE = Register(144, 2, 0)
TEMPERATURE = Register(146, 1, 0)

REGISTERS = tuple(value for value in list(globals().values()) if isinstance(value, Register))

WATCHDOG_UNIT_NS = 20_000_000
EXPIRED = 0xFF  # of the watchdog: goals are refused until 0 is written
GOALS = (GOAL_PWM, GOAL)

# The error number of a status packet; bit 7 says that there is a hardware error.
INSTRUCTION_ERROR, CRC_ERROR, DATA_RANGE, DATA_LENGTH, DATA_LIMIT, ACCESS = 2, 3, 4, 5, 6, 7
ALERT = 0x80


@dataclass(frozen=True, slots=True)
class XKind(Kind):
    """What differs between servos with this table.

    Attributes
    ----------
    gain
        P gain to which the physical parameters of the servo belong.
    load_unit
        The register of the load at the greatest torque.
    """

    gain: int = P_GAIN.default
    load_unit: int = 1000


# By the e-manual of each model.
XL430 = XKind(1060, 61.0)
MX28_2 = XKind(
    30,
    55.0,
    factory=((VOLTAGE_MIN, 95), (VOLTAGE_MAX, 160), (TEMPERATURE_LIMIT, 80), (P_GAIN, 850)),
    gain=850,
)
XL330_M288 = XKind(
    1200,
    103.0,
    supply=5.0,
    factory=(
        (VOLTAGE_MIN, 35),
        (VOLTAGE_MAX, 70),
        (TEMPERATURE_LIMIT, 70),
        (SHUTDOWN, 53),
        (P_GAIN, 400),
    ),
    gain=1200,
    load_unit=1750,
)
XL330_M077 = replace(XL330_M288, model=1190, rpm=383.0)


class XTable(Registers):
    """The bytes of the table; the rules for writing apply to the host, not to the servo."""

    def __init__(self, kind: XKind = XL430) -> None:
        defaults = {MODEL: kind.model, **dict(kind.factory)}
        super().__init__([replace(r, default=defaults.get(r, r.default)) for r in REGISTERS], SIZE)

    def write(self, address: int, data: bytes) -> int:
        """Write whole registers if all are allowed; return the error number, 0 if it was done."""
        end = address + len(data)
        touched = self.touched(address, len(data))
        if sum(r.size for r in touched) != len(data) or any(r.high is None for r in touched):
            return ACCESS
        if self[TORQUE_ENABLE] and any(r.address < EEPROM_END for r in touched):
            return ACCESS
        before = bytes(self._bytes)
        self._bytes[address:end] = data
        if all(r.low <= self[r] <= (r.high or 0) for r in touched) and self._goal_allowed(touched):
            return 0
        self._bytes[:] = before
        return DATA_LIMIT

    def _goal_allowed(self, touched: list[Register]) -> bool:
        return GOAL not in touched or self[MIN_POSITION] <= self[GOAL] <= self[MAX_POSITION]
