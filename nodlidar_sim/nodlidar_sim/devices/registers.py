"""Registers of a servo, and the bytes that hold them."""

from collections.abc import Sequence
from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True)
class Register:
    """A register of the table, least significant byte first.

    Attributes
    ----------
    address, size, default
        First byte, number of bytes, and value after a reset.
    low, high
        Allowed values; the register is read-only if high is None.
    """

    address: int
    size: int
    default: int
    low: int = 0
    high: int | None = None


@dataclass(frozen=True, slots=True)
class Kind:
    """A model of servo, among those with the same table.

    Attributes
    ----------
    model
        Model number.
    rpm, supply
        Speed without load [rev/min] at a voltage of the supply [V].
    factory
        Defaults of registers where they are not those of the table.
    """

    model: int
    rpm: float
    supply: float = 12.0
    factory: tuple[tuple[Register, int], ...] = ()

    @property
    def fastest(self) -> float:
        """Speed without load at its supply [rad/s]."""
        return self.rpm * math.tau / 60.0


class Registers:
    """The bytes of a table, by registers; the rules for writing apply to the host only.

    Parameters
    ----------
    registers
        All registers.
    size
        Number of bytes.
    """

    def __init__(self, registers: Sequence[Register], size: int) -> None:
        self._registers = registers
        self._bytes = bytearray(size)
        self.reset()

    def __getitem__(self, register: Register) -> int:
        begin = register.address
        return int.from_bytes(self._bytes[begin : begin + register.size], 'little')

    def __setitem__(self, register: Register, value: int) -> None:
        begin, mask = register.address, (1 << 8 * register.size) - 1
        data = (value & mask).to_bytes(register.size, 'little')
        self._bytes[begin : begin + register.size] = data

    def reset(self, begin: int = 0) -> None:
        """Set every register from an address on to its default."""
        for register in self._registers:
            if register.address >= begin:
                self[register] = register.default

    def read(self, address: int, size: int) -> bytes | None:
        """Return bytes of the table, None if some are outside."""
        if size < 1 or address + size > len(self._bytes):
            return None
        return bytes(self._bytes[address : address + size])

    def touched(self, address: int, size: int) -> list[Register]:
        """Return the registers of which a write includes at least one byte."""
        end = address + size
        return [r for r in self._registers if r.address < end and address < r.address + r.size]


def sign_magnitude(value: float, sign: int) -> int:
    """Return a value as a register with a sign bit."""
    magnitude = min(round(abs(value)), sign - 1)
    return magnitude | (sign if value < 0.0 and magnitude else 0)
