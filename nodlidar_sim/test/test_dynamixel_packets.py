from hypothesis import given
from hypothesis import strategies as st
from nodlidar_sim.devices.dynamixel_packets import InstructionReader, status_packet
import pytest

PING = bytes.fromhex('FFFF010201FB')
READ_MODEL = bytes.fromhex('FFFF0104020002F6')


def read_all(*pieces, gap_ns=0):
    reader = InstructionReader()
    found = []
    for i, piece in enumerate(pieces):
        found += [instruction for instruction, _ in reader.feed(piece, i * gap_ns)]
    return [(f.servo_id, f.code, f.parameters, f.sound) for f in found]


def test_vectors():
    assert read_all(PING + READ_MODEL) == [(1, 1, b'', True), (1, 2, b'\x00\x02', True)]
    assert status_packet(1, 0) == bytes.fromhex('FFFF010200FC')
    assert status_packet(1, 0, b'\x18\x00') == bytes.fromhex('FFFF0104001800E2')


@given(st.integers(0, 8))
def test_packets_may_come_in_pieces(cut):
    assert read_all(READ_MODEL[:cut], READ_MODEL[cut:]) == [(1, 2, b'\x00\x02', True)]


@pytest.mark.parametrize(
    'noise', [b'', b'\xff', b'\xff\xff', b'\xff\xff\xff', b'abc', b'\x00\xff', b'\xff\xff\x01\x01']
)
def test_noise_before_a_packet_is_skipped(noise):
    assert read_all(noise + PING) == [(1, 1, b'', True)]


def test_a_wrong_checksum_is_reported():
    assert read_all(READ_MODEL[:-1] + b'\x00') == [(1, 2, b'', False)]


def test_a_packet_that_pauses_is_given_up():
    assert read_all(b'\xff\xff\x01\x40', PING, gap_ns=100_000_001) == [(1, 1, b'', True)]
    assert read_all(READ_MODEL[:4], READ_MODEL[4:], gap_ns=100_000_000) == [
        (1, 2, b'\x00\x02', True)
    ]


def test_how_many_of_the_data_each_packet_took():
    reader = InstructionReader()
    assert [taken for _, taken in reader.feed(b'xx' + PING + READ_MODEL + b'\xff', 0)] == [8, 16]
    assert [taken for _, taken in reader.feed(PING[1:], 0)] == [5]


@given(st.lists(st.binary(max_size=300)))
def test_garbage_never_crashes_and_after_a_pause_all_is_well(pieces):
    reader = InstructionReader()
    for piece in pieces:
        for _, taken in reader.feed(piece, 0):
            assert 0 < taken <= len(piece)
    assert len(reader._buffer) < 260
    assert [i.code for i, _ in reader.feed(PING, 200_000_000)] == [1]
