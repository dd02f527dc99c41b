from hypothesis import given
from hypothesis import strategies as st
from nodlidar_sim.devices.dynamixel_packets_2 import InstructionReader, packet, status_packet
import pytest

# From ROBOTIS' e-manual, Protocol 2.0.
PING = bytes.fromhex('FFFFFD00 01 0300 01 194E')
READ_POSITION = bytes.fromhex('FFFFFD00 01 0700 02 84000400 1D15')


def read_all(*pieces):
    reader = InstructionReader()
    found = [instruction for piece in pieces for instruction, _ in reader.feed(piece, 0)]
    return [(f.servo_id, f.code, f.parameters, f.sound) for f in found]


def test_vectors_of_the_manual():
    assert packet(1, 1) == PING
    assert packet(1, 2, bytes.fromhex('84000400')) == READ_POSITION
    assert packet(1, 3, bytes.fromhex('740000020000')).hex() == 'fffffd0001090003740000020000ca89'
    answer = bytes.fromhex('FFFFFD00 01 0800 55 00 A6000000 8CC0')
    assert status_packet(1, 0, bytes.fromhex('A6000000')) == answer
    model = bytes.fromhex('FFFFFD00 01 0700 55 00 060426 655D')
    assert status_packet(1, 0, bytes.fromhex('060426')) == model


@given(st.integers(0, 252), st.integers(1, 0x54), st.binary(max_size=60), st.integers(0, 100))
def test_what_is_packed_is_read_from_pieces(servo_id, code, parameters, cut):
    """Those with FF FF FD, too."""
    for data in (parameters, b'\xff\xff\xfd' + parameters, parameters + b'\xff\xff\xfd'):
        whole = packet(servo_id, code, data)
        assert whole.find(b'\xff\xff\xfd\x00', 4) == -1 or b'\xfd\x00' in data
        assert read_all(whole[:cut], whole[cut:]) == [(servo_id, code, data, True)]


@pytest.mark.parametrize(
    'noise', [b'', b'\xff', b'\xff\xff', b'\xff\xff\xff', b'abc', b'\xff\xff\xfd\x01', bytes(140)]
)
def test_noise_before_a_packet_is_skipped(noise):
    assert read_all(noise + PING) == [(1, 1, b'', True)]


def test_a_wrong_crc_is_reported():
    assert read_all(READ_POSITION[:-1] + b'\x00') == [(1, 2, b'', False)]


@given(st.lists(st.binary(max_size=300)))
def test_garbage_never_crashes_and_after_a_pause_all_is_well(pieces):
    reader = InstructionReader()
    for piece in pieces:
        list(reader.feed(piece, 0))
    assert [i.code for i, _ in reader.feed(PING, 200_000_000)] == [1]
