from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.devices.faulty_line import FaultyLine
import numpy as np
import pytest

MS = 1_000_000
DATA = bytes(range(256)) * 100


class Echo:
    """Sends every byte back at once, and notes when it came."""

    def __init__(self):
        self.data, self.heard = b'', []

    def receive(self, data, now_ns):
        self.data += data
        self.heard.append((data, now_ns))

    def transmit(self, now_ns):
        sent, self.data = self.data, b''
        return sent

    def next_event_ns(self):
        return None


def test_a_sound_line_hands_everything_on_at_once():
    line = FaultyLine()
    assert line.carry(DATA, 5) == DATA
    assert line.carry(b'', 6) == b''
    assert line.next_event_ns() is None
    assert line.first_hit_ns is None


def test_bytes_are_inserted_and_none_is_lost():
    line = FaultyLine(seed=2)
    line.insert_rate = 0.01
    received = line.carry(DATA, 0)
    assert len(received) / len(DATA) == pytest.approx(1.01, abs=0.002)
    rest = iter(received)
    assert all(byte in rest for byte in DATA)  # in order


def test_bytes_change_places_and_none_is_lost():
    line = FaultyLine(seed=2)
    line.swap_rate = 0.01
    received = line.carry(DATA, 7)
    assert sum(received) == sum(DATA)
    moved = [a != b for a, b in zip(received, DATA, strict=True)]
    assert sum(moved) / len(DATA) == pytest.approx(0.02, abs=0.003)
    assert line.first_hit_ns == 7


def test_a_delay_holds_bytes_and_keeps_their_order():
    line = FaultyLine()
    line.delay_ns = 300 * MS
    assert line.carry(b'a', 1000) == b''
    assert line.first_hit_ns == 1000
    assert line.next_event_ns() == 1000 + 300 * MS
    line.mend()
    assert line.carry(b'b', 2000) == b''
    assert line.carry(b'', 1000 + 300 * MS) == b'ab'


def test_jitter_is_within_its_limits_and_nothing_overtakes():
    line = FaultyLine(seed=3)
    line.delay_ns, line.jitter_ns = 10 * MS, 40 * MS
    sent = {bytes([i]): i * 5 * MS for i in range(200)}
    arrived = {}
    for now_ns in range(0, 2000 * MS, MS):
        data = bytes([now_ns // (5 * MS)]) if not now_ns % (5 * MS) and now_ns < 1000 * MS else b''
        for byte in line.carry(data, now_ns):
            arrived[bytes([byte])] = now_ns
    late = np.array([arrived[byte] - sent_ns for byte, sent_ns in sent.items()])
    assert list(arrived) == list(sent)
    assert late.min() >= 10 * MS
    assert late.max() <= 51 * MS
    assert np.ptp(late) > 10 * MS


def test_the_first_hit_is_when_a_byte_first_suffered():
    line = FaultyLine()
    line.carry(b'a', 1)
    line.mute = True
    line.carry(b'', 2)
    assert line.first_hit_ns is None
    assert line.carry(b'b', 3) == b''
    line.carry(b'c', 4)
    assert line.first_hit_ns == 3
    line.mend()
    assert line.first_hit_ns is None


def test_either_direction_of_a_device_can_be_bad():
    echo = Echo()
    device = FaultyDevice(echo)
    device.to_device.mute = True
    device.receive(b'unheard', 0)
    assert echo.heard == []
    device.to_device.mend()
    device.to_device.delay_ns = 20 * MS
    device.receive(b'late', 10)
    assert device.next_event_ns() == 10 + 20 * MS
    assert device.transmit(10 + 20 * MS - 1) == b''
    assert device.transmit(10 + 20 * MS) == b'late'
    assert echo.heard == [(b'late', 10 + 20 * MS)]
    device.mute = True
    device.receive(b'no answer', 10 + 40 * MS)
    assert device.transmit(10 + 80 * MS) == b''
    assert echo.heard[-1] == (b'no answer', 10 + 60 * MS + 20 * MS)
