"""The packets of LDROBOT's LD06 and LD19, which these lidars send without being asked.

Source: LDROBOT's development manual of the LD19, which also has the packet of the test.
"""

import numpy as np
from numpy.typing import NDArray

LD19 = 'LD19'
"""Its name; an LD06 sends the same."""

HEADER = b'\x54\x2c'
POINTS = 12
"""Beams of a packet."""

BIT_RATE = 230_400
POINT_RATE = 4500.0
"""Beams per second."""

ROTATION_RATE = 10.0
"""Revolutions per second, with its PWM wire at ground."""

RANGE_MM = 20, 12_000
"""What the lidar can measure, by its data sheet."""

TIMER_MS = 30_000
"""Milliseconds after which the timer of the packets begins again."""

PACKET = np.dtype(
    [
        ('header', 'V2'),
        ('speed', '<u2'),  # degrees per second
        ('start_angle', '<u2'),  # of the first beam, clockwise [0.01 degrees]
        ('points', [('distance', '<u2'), ('confidence', 'u1')], (POINTS,)),  # mm, 0: no return
        ('end_angle', '<u2'),  # of the last beam
        ('timer', '<u2'),  # ms
        ('checksum', 'u1'),
    ]
)

_POLYNOMIAL = 0x4D


def _shifted(value: int) -> int:
    for _ in range(8):
        value = value << 1 ^ (_POLYNOMIAL if value & 0x80 else 0)
    return value & 0xFF


def _tables() -> NDArray[np.uint8]:
    """Return what each value of each byte adds to a checksum, by exclusive or, shape (46, 256)."""
    table = np.array([_shifted(value) for value in range(256)], dtype=np.uint8)
    tables = [table]  # of the last byte
    while len(tables) < PACKET.itemsize - 1:
        tables.append(table[tables[-1]])
    return np.stack(tables[::-1])


_TABLES = _tables()
_PLACES = np.arange(len(_TABLES))


def checksums(packets: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the CRC-8 of packets, shape (n, 47), but for their last bytes; shape (n,)."""
    return np.asarray(np.bitwise_xor.reduce(_TABLES[_PLACES, packets[:, :-1]], axis=1))
