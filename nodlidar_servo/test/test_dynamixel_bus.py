import contextlib
import errno
import termios

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import PortError
from nodlidar_servo.bus.dynamixel_bus import DynamixelBus
from nodlidar_servo.bus.replies import (
    CorruptReplyError,
    NoAnswerError,
    RefusedError,
    ReplyError,
    status_names,
)
import pytest
from serial import SerialException


def packet(*body):
    """Return a packet of ID, length, instruction or error, parameters."""
    return bytes([0xFF, 0xFF, *body, ~sum(body) & 0xFF])


class Script:
    """A port that answers each write with the next reply; an exception as reply is raised."""

    def __init__(self, *replies):
        self.timeout = None
        self.written = []
        self._replies = list(replies)
        self._input = b''

    def write(self, data):
        if not any(data):  # the rest of a packet that the motor may wait for
            return len(data)
        self.written.append(bytes(data))
        reply = self._replies.pop(0) if self._replies else b''
        if isinstance(reply, Exception):
            raise reply
        self._input += reply
        return len(data)

    def read(self, size):
        data, self._input = self._input[:size], self._input[size:]
        return data

    def reset_input_buffer(self):
        self._input = b''

    def arrive(self, data):
        self._input += data


class Clock:
    def __init__(self):
        self.now_ns = 0

    def __call__(self):
        self.now_ns += 1000
        return self.now_ns


def bus(*replies):
    script = Script(*replies)
    return DynamixelBus(script, 1, 1_000_000, Clock()), script


def test_reading_the_model_number_matches_the_vectors_of_the_manual():
    dynamixel, script = bus(bytes.fromhex('FFFF0104001800E2'))
    assert dynamixel.read(0, 2).data == b'\x18\x00'
    assert script.written == [bytes.fromhex('FFFF0104020002F6')]


def test_read_returns_the_data_and_the_times_around_the_transaction():
    dynamixel, _ = bus(packet(1, 4, 0, 7, 8))
    reply = dynamixel.read(36, 2)
    assert (reply.data, reply.status) == (b'\x07\x08', 0)
    assert reply.sent_ns == 1000
    assert reply.received_ns > reply.sent_ns


def test_write_sends_the_block_and_waits_for_the_confirmation():
    dynamixel, script = bus(packet(1, 2, 0))
    dynamixel.write(30, b'\x00\x02\x0a\x00')
    assert script.written == [packet(1, 7, 3, 30, 0x00, 0x02, 0x0A, 0x00)]


def test_post_is_a_sync_write_that_waits_for_nothing():
    dynamixel, script = bus()
    dynamixel.post(30, b'\x00\x02\x0a\x00')
    assert script.written == [packet(0xFE, 9, 0x83, 30, 4, 1, 0x00, 0x02, 0x0A, 0x00)]


@pytest.mark.parametrize(
    ('reply', 'error'),
    [
        (b'', NoAnswerError),
        (packet(1, 4, 0, 7, 8)[:-1], CorruptReplyError),
        (packet(1, 4, 0, 7, 8)[:-1] + b'\x00', CorruptReplyError),
        (packet(1, 2, 0), CorruptReplyError),  # no data at all
        (packet(1, 3, 0, 7), NoAnswerError),  # too little: the answer to something else
        (packet(2, 4, 0, 7, 8), NoAnswerError),  # another motor
        (packet(1, 2, 0x40), RefusedError),
        (b'\x55' * 40, CorruptReplyError),
    ],
)
def test_a_bad_reply_has_its_own_error_and_does_not_disturb_the_next(reply, error):
    dynamixel, _ = bus(reply, packet(1, 4, 0, 7, 8))
    with pytest.raises(error):
        dynamixel.read(36, 2)
    assert dynamixel.read(36, 2).data == b'\x07\x08'


def test_a_reply_without_data_is_not_read_from_its_checksum():
    dynamixel, _ = bus(packet(1, 2, 0x20))
    with pytest.raises(CorruptReplyError):
        dynamixel.read(5, 1)


def test_noise_before_a_reply_is_skipped():
    dynamixel, _ = bus(b'\x00\xff\x12' + packet(1, 4, 0, 7, 8))
    assert dynamixel.read(36, 2).data == b'\x07\x08'


def test_an_alarm_with_data_is_a_sample_with_a_status():
    dynamixel, _ = bus(packet(1, 4, 0x24, 7, 8))
    reply = dynamixel.read(36, 2)
    assert reply.data == b'\x07\x08'
    assert status_names(reply.status) == 'overheating, overload'


def test_a_refusal_names_every_bit():
    dynamixel, _ = bus(packet(1, 2, 0x0A))
    with pytest.raises(RefusedError, match='angle limit, range'):
        dynamixel.write(30, b'\x00\x00')


@pytest.mark.parametrize(
    'gone',
    [SerialException('gone'), OSError(errno.EIO, 'gone'), termios.error(errno.EIO, 'gone')],
)
def test_a_port_that_goes_away_is_a_port_error_and_not_for_ever_busy(gone):
    dynamixel, _ = bus(gone, gone, packet(1, 4, 0, 7, 8))
    with pytest.raises(PortError, match='gone'):
        dynamixel.read(36, 2)
    with pytest.raises(PortError, match='gone'):
        dynamixel.post(30, b'\x00\x00')
    assert dynamixel.read(36, 2).data == b'\x07\x08'


def test_a_late_reply_is_not_taken_for_that_of_a_later_request():
    """The one of 8 bytes comes when 9 have been asked for, before their own."""
    late, own = packet(1, 10, 0, *range(8)), packet(1, 11, 0, *range(10, 19))
    dynamixel, script = bus(b'', late + own, packet(1, 11, 0, *range(20, 29)))
    with pytest.raises(NoAnswerError):
        dynamixel.read(36, 8, spare=6)
    assert dynamixel.read(36, 8, spare=6).data == bytes(range(11, 19))
    assert dynamixel.read(36, 8, spare=6).data == bytes(range(21, 29))
    assert [tuple(request[5:7]) for request in script.written] == [(36, 8), (35, 9), (35, 9)]


def test_a_late_confirmation_is_not_taken_for_that_of_a_later_write():
    """A torque that is to be off is not off because it was once switched on."""
    dynamixel, script = bus(b'')
    with pytest.raises(NoAnswerError):
        dynamixel.write(24, b'\x01')
    script.arrive(packet(1, 2, 0))
    with pytest.raises(NoAnswerError):
        dynamixel.write(24, b'\x00')


def test_noise_without_end_is_no_answer():
    class Noise(Script):
        def read(self, size):
            assert self.written
            return b'\xff\x00' * (size // 2) + b'\xff' * (size % 2)

    dynamixel = DynamixelBus(Noise(), 1, 1_000_000, Clock())
    for _ in range(5):
        with pytest.raises(CorruptReplyError):
            dynamixel.read(36, 8, spare=6)
    with pytest.raises(CorruptReplyError):
        dynamixel.write(24, b'\x00')


@given(st.lists(st.binary(max_size=40), max_size=12))
def test_nothing_that_comes_raises_anything_else(replies):
    dynamixel, _ = bus(*replies)
    for _ in replies:
        with contextlib.suppress(ReplyError):
            assert len(dynamixel.read(36, 2, spare=6).data) == 2
        with contextlib.suppress(ReplyError):
            dynamixel.write(24, b'\x00')
