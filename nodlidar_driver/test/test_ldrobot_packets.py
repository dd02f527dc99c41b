"""Packets of an LD19 in a stream of bytes."""

from hypothesis import assume, given
from hypothesis import strategies as st
from nodlidar_common.ldrobot import checksums, HEADER, PACKET
from nodlidar_driver.ldrobot.packets import take_packets
import numpy as np
import pytest

# The example of LDROBOT's development manual, with what it says of it.
EXAMPLE = bytes.fromhex(
    '542C6808AB7EE000E4DC00E2D900E5D500E3D300E4D000E9CD00E4CA00E2C700E9C500E5C200E5C000E5BE823A1A50'
)
DISTANCES = [224, 220, 217, 213, 211, 208, 205, 202, 199, 197, 194, 192]


def packets(count, seed=0):
    """Return good packets with random contents, which have headers in them, too."""
    made = np.random.default_rng(seed).integers(0, 256, (count, PACKET.itemsize), dtype=np.uint8)
    made[:, :2] = made[:, 20:22] = np.frombuffer(HEADER, np.uint8)
    made[:, -1] = checksums(made)
    return made


def is_good(row):
    """Return whether bytes are a packet."""
    return row.startswith(HEADER) and checksums(np.frombuffer(row, np.uint8)[None]) == row[-1]


def test_the_example_of_the_manual_is_read():
    taken = take_packets(bytearray(EXAMPLE))
    [packet], useless = taken
    assert useless == 0
    assert packet['speed'] == 2152
    assert (packet['start_angle'], packet['end_angle']) == (32427, 33470)
    assert packet['points']['distance'].tolist() == DISTANCES
    assert packet['points']['confidence'][:3].tolist() == [228, 226, 229]
    assert packet['timer'] == 6714


@pytest.mark.parametrize('bit', range(8))
@pytest.mark.parametrize('byte', [0, 1, 2, 20, 45, 46])
def test_one_wrong_bit_makes_it_none(byte, bit):
    changed = bytearray(EXAMPLE)
    changed[byte] ^= 1 << bit
    assert len(take_packets(changed).packets) == 0


@given(st.lists(st.integers(1, 200), min_size=1, max_size=30), st.integers(0, 46))
def test_however_the_bytes_come_the_packets_are_the_same(sizes, begin):
    sent = packets(20).tobytes()[begin:]
    buffer, found, useless, at = bytearray(), [], 0, 0
    for size in [*sizes, len(sent)]:
        buffer += sent[at : at + size]
        at += size
        taken = take_packets(buffer)
        found += [packet.tobytes() for packet in taken.packets]
        useless += taken.useless
    assert found == [each.tobytes() for each in packets(20)[1 if begin else 0 :]]
    assert useless + len(buffer) == (PACKET.itemsize - begin) % PACKET.itemsize


@given(
    st.integers(0, 400), st.binary(min_size=1, max_size=100), st.integers(0, 60), st.integers(0, 9)
)
def test_only_packets_that_were_changed_are_lost(at, inserted, removed, seed):
    sent, size = packets(12, seed).tobytes(), PACKET.itemsize
    sent = sent[:at] + inserted + sent[at + removed :]
    begins = [i for i in range(len(sent) - size + 1) if is_good(sent[i : i + size])]
    # Changed bytes, too, have a right checksum once in 256 times, and may reach into the next.
    assume(np.all(np.diff(begins) >= size))
    found = take_packets(bytearray(sent)).packets
    assert [packet.tobytes() for packet in found] == [sent[i : i + size] for i in begins]
