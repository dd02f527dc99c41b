"""The wire format of SCIP 2.0, Hokuyo's serial protocol: sums, 6-bit characters, data blocks.

Section numbers refer to Hokuyo's specification C-42-03320B.
"""

from collections.abc import Iterable, Sequence
import re

from nodlidar_common.arrays import Integers
from nodlidar_common.errors import DeviceError
import numpy as np

BLOCK = 64
"""Data characters in one line (section 7)."""

TIMER_BITS = 24
"""Bits of the lidar's millisecond timer, which is sent as four characters of 6 bits."""

_ZERO = 0x30
_MASK = 0x3F
_INVALID = re.compile(rb'[^0-o]')


class ScipError(DeviceError):
    """Bytes that are not valid SCIP 2.0: a wrong sum, an invalid character, a wrong length."""


def checksum(data: bytes) -> bytes:
    """Return the sum character of some bytes (section 7)."""
    return bytes(((sum(data) & _MASK) + _ZERO,))


def add_sum(data: bytes) -> bytes:
    """Return a line of a reply: the data and its sum, without the line feed."""
    return data + checksum(data)


def strip_sum(line: bytes) -> bytes:
    """Return the data of a line that ends with its sum; raises ScipError if the sum is wrong."""
    data, given = line[:-1], line[-1:]
    if given != checksum(data):
        raise ScipError(f'the sum of {data!r} is {checksum(data)!r}, but {given!r} was received')
    return data


def encode(values: Sequence[int] | Integers, characters: int) -> bytes:
    """Encode numbers in 6-bit characters, most significant first (section 6).

    Parameters
    ----------
    values
        Whole numbers in [0, 64**characters), shape (n,).
    characters
        Characters for each number: 2, 3 or 4.

    Raises
    ------
    ScipError
        If a value needs more characters.
    """
    numbers = np.asarray(values, dtype=np.int64)
    if numbers.size and (numbers.min() < 0 or numbers.max() >> 6 * characters):
        raise ScipError(
            f'a value must be in 0..{64**characters - 1} for {characters} characters, '
            f'but they span {numbers.min()}..{numbers.max()}'
        )
    digits = numbers[:, np.newaxis] >> _shifts(characters) & _MASK
    return (digits + _ZERO).astype(np.uint8).tobytes()


def decode(data: bytes, characters: int) -> Integers:
    """Decode numbers of 6-bit characters, the inverse of :func:`encode`; shape (n,).

    Raises
    ------
    ScipError
        If a byte is not such a character, or the last number is incomplete.
    """
    if len(data) % characters:
        raise ScipError(f'{len(data)} bytes are not a multiple of {characters} characters')
    invalid = _INVALID.search(data)
    if invalid:
        raise ScipError(f'byte {invalid.group()!r} at {invalid.start()} is not a 6-bit character')
    digits = np.frombuffer(data, np.uint8).reshape(-1, characters).astype(np.int64) - _ZERO
    return np.asarray((digits << _shifts(characters)).sum(axis=1), dtype=np.int64)


def split_blocks(data: bytes) -> list[bytes]:
    """Cut data into lines of at most 64 characters, each followed by its sum (section 7)."""
    return [add_sum(data[i : i + BLOCK]) for i in range(0, len(data), BLOCK)]


def join_blocks(lines: Iterable[bytes]) -> bytes:
    """Check each line's sum and join the data, the inverse of :func:`split_blocks`.

    Raises
    ------
    ScipError
        If a sum is wrong.
    """
    return b''.join(map(strip_sum, lines))


def information_line(key: str, value: str) -> bytes:
    """Return a line of VV, PP or II, ``KEY:value;sum``; the sum excludes the semicolon."""
    text = f'{key}:{value}'.encode('ascii')
    return text + b';' + checksum(text)


def parse_information(line: bytes) -> tuple[str, str]:
    """Return key and value of a line of VV, PP or II; raises ScipError if it is invalid."""
    text, semicolon = line[:-2], line[-2:-1]
    key, colon, value = text.partition(b':')
    if semicolon != b';' or not colon or line[-1:] != checksum(text):
        raise ScipError(f'{line!r} is not a valid information line KEY:value;sum')
    return key.decode('ascii', 'replace'), value.decode('ascii', 'replace')


def _shifts(characters: int) -> Integers:
    return 6 * np.arange(characters - 1, -1, -1, dtype=np.int64)
