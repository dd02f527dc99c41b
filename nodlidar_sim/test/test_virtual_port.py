from nodlidar_common.errors import PortError
from nodlidar_sim.ports.byte_buffer import BoundedBuffer, BUFFER_BYTES
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import pytest
from serial import SerialException

MS = 1_000_000


class Echo:
    """Sends every byte back, one millisecond a byte after its arrival."""

    def __init__(self):
        self.due = []

    def receive(self, data, now_ns):
        self.due += [(now_ns + (i + 1) * MS, byte) for i, byte in enumerate(data)]

    def transmit(self, now_ns):
        sent = bytes(byte for time_ns, byte in self.due if time_ns <= now_ns)
        self.due = self.due[len(sent) :]
        return sent

    def next_event_ns(self):
        return self.due[0][0] if self.due else None


class Repeat(Echo):
    """Sends everything back at once."""

    def receive(self, data, now_ns):
        self.due = [(now_ns, byte) for byte in data]

    def next_event_ns(self):
        return None


@pytest.fixture
def clock():
    return VirtualClock(5)


@pytest.fixture
def port(clock):
    return VirtualPort(Echo(), clock, timeout=0.010)


def test_read_takes_as_long_as_the_bytes_take(port, clock):
    port.write(b'abc')
    assert port.read(2) == b'ab'
    assert clock() == 5 + 2 * MS


def test_read_returns_what_came_before_the_timeout(port, clock):
    port.write(b'0123456789ABCDEF')
    assert port.read(16) == b'0123456789'
    assert clock() == 5 + 10 * MS


def test_read_without_timeout_does_not_wait(port, clock):
    port.timeout = 0
    port.write(b'a')
    assert port.read() == b''
    assert clock() == 5


def test_an_endless_read_ends_with_the_bytes(port):
    port.timeout = None
    port.write(b'ab')
    assert port.read(2) == b'ab'
    with pytest.raises(PortError, match='wait for ever'):
        port.read()


def test_bytes_that_wait_are_counted_and_can_be_forgotten(port, clock):
    port.write(b'abc')
    clock.advance_to(5 + 2 * MS)
    assert port.in_waiting == 2
    port.reset_input_buffer()
    assert port.in_waiting == 0
    assert port.read(1) == b'c'


def test_time_never_goes_back(clock):
    clock.advance_to(3)
    assert clock() == 5


def test_an_unplugged_port_fails_like_a_real_one(port):
    port.unplug()
    with pytest.raises(SerialException):
        port.read()
    with pytest.raises(SerialException):
        port.write(b'a')
    with pytest.raises(OSError, match='Input/output'):
        _ = port.in_waiting
    with pytest.raises(SerialException):
        port.timeout = 1.0


def test_a_closed_port_refuses_everything(port):
    port.close()
    assert not port.is_open
    with pytest.raises(SerialException, match='closed'):
        port.read()


def test_a_full_buffer_loses_the_oldest_bytes_and_counts_them(clock):
    port = VirtualPort(Repeat(), clock, timeout=0)
    port.write(bytes(BUFFER_BYTES) + b'new')
    assert port.in_waiting == BUFFER_BYTES
    assert port.dropped == 3
    assert port.read(BUFFER_BYTES).endswith(b'\0new')


def test_bounded_buffer_keeps_the_newest():
    buffer = BoundedBuffer(4)
    buffer.append(b'abcdef')
    assert (buffer.peek(9), buffer.dropped) == (b'cdef', 2)
    buffer.discard(3)
    buffer.append(b'gh')
    assert (buffer.peek(9), buffer.dropped) == (b'fgh', 2)
