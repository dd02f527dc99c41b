"""The emulated RX-24F in virtual time: protocol, registers, timing, motion."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_sim.devices.dynamixel_packets import checksum
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np
import pytest

START = 1_700_000_000_000_000_000
TICK = math.radians(300) / 1024
UNIT = 0.111 * 2 * math.pi / 60


class Bus:
    """A host that speaks Protocol 1.0 in raw bytes."""

    def __init__(self, start_ns=START, jitter=0.0, motion=None, **options):
        options = {'baud': 1, 'return_delay': 0, **options}
        self.clock = VirtualClock(start_ns)
        self.motion = motion or IdealServo(jitter=jitter)
        self.servo = RxServoEmulator(self.motion, **options)
        self.port = VirtualPort(self.servo, self.clock, timeout=0.1)

    def raw(self, data):
        self.port.write(data)
        head = self.port.read(4)
        return head + self.port.read(head[3]) if head else None

    def send(self, code, *parameters, servo_id=1):
        """Return (error bits, data) of the answer, None if there is none."""
        body = bytes((servo_id, len(parameters) + 2, code, *parameters))
        reply = self.raw(b'\xff\xff' + body + bytes((checksum(body),)))
        if reply is None:
            return None
        assert reply[:2] == b'\xff\xff'
        assert reply[-1] == checksum(reply[2:-1])
        return reply[4], reply[5:-1]

    def write(self, address, *data):
        error, rest = self.send(3, address, *data)
        assert rest == b''
        return error

    def write_word(self, address, value):
        return self.write(address, value & 0xFF, value >> 8)

    def read(self, address, size=1):
        error, data = self.send(2, address, size)
        assert len(data) == size
        assert error == 0
        return int.from_bytes(data, 'little')

    def wait(self, seconds):
        self.clock.advance_to(self.clock() + round(seconds * 1e9))

    def pitch(self):
        return float(self.motion.position(np.array([self.clock()]))[0])


@pytest.fixture
def bus():
    return Bus()


def test_vectors(bus):
    assert bus.raw(bytes.fromhex('FFFF010201FB')) == bytes.fromhex('FFFF010200FC')
    assert bus.raw(bytes.fromhex('FFFF0104020002F6')) == bytes.fromhex('FFFF0104001800E2')


DEFAULTS = {
    0: (2, 24), 2: (1, 1), 3: (1, 1), 4: (1, 34), 5: (1, 250), 6: (2, 0), 8: (2, 1023),
    11: (1, 80), 12: (1, 60), 13: (1, 190), 14: (2, 1023), 16: (1, 2), 17: (1, 36), 18: (1, 36),
    24: (1, 0), 25: (1, 0), 26: (1, 1), 27: (1, 1), 28: (1, 32), 29: (1, 32), 30: (2, 512),
    32: (2, 0), 34: (2, 1023), 36: (2, 512), 38: (2, 0), 40: (2, 0), 42: (1, 120), 43: (1, 35),
    44: (1, 0), 46: (1, 0), 47: (1, 0), 48: (2, 32),
}  # fmt: skip


def test_a_servo_from_the_factory():
    bus = Bus(baud=34, return_delay=250)
    assert {a: (n, bus.read(a, n)) for a, (n, _) in DEFAULTS.items()} == DEFAULTS


def test_reset_brings_the_factory_state_back():
    bus = Bus(servo_id=7)
    assert bus.send(6, servo_id=7) == (0, b'')
    assert bus.send(1, servo_id=7) is None
    assert {a: (n, bus.read(a, n)) for a, (n, _) in DEFAULTS.items()} == DEFAULTS


@pytest.mark.parametrize(('address', 'size'), [(0, 51), (49, 2), (50, 1), (255, 255), (0, 0)])
def test_reading_beyond_the_table_is_a_range_error(bus, address, size):
    assert bus.send(2, address, size) == (0x08, b'')


@pytest.mark.parametrize('address', [0, 1, 2, 10, 19, 23, 36, 37, 38, 40, 42, 43, 44, 45, 46, 50])
def test_what_may_not_be_written_is_a_range_error(bus, address):
    before = bus.send(2, 0, 36)
    assert bus.write(address, 1) == 0x08
    assert bus.send(2, 0, 36) == before


@pytest.mark.parametrize(
    ('address', 'value', 'size'),
    [
        (3, 254, 1),
        (4, 255, 1),
        (6, 1024, 2),
        (8, 1024, 2),
        (11, 151, 1),
        (12, 49, 1),
        (16, 3, 1),
        (18, 128, 1),
        (24, 2, 1),
        (28, 0, 1),
        (30, 1024, 2),
        (32, 2048, 2),
        (34, 1024, 2),
        (47, 2, 1),
        (48, 1024, 2),
    ],
)
def test_values_out_of_range_are_refused(bus, address, value, size):
    before = bus.read(address, size)
    assert bus.write(address, *value.to_bytes(size, 'little')) & 0x08
    assert bus.read(address, size) == before


def test_a_write_is_all_or_nothing(bus):
    assert bus.write(24, 1, 2) == 0x08
    assert bus.read(24) == 0


def test_one_byte_of_a_register_can_be_written(bus):
    assert bus.write(33, 1) == 0
    assert bus.read(32, 2) == 256


def test_goals_beyond_the_angle_limits_are_refused(bus):
    bus.write_word(6, 300)
    bus.write_word(8, 700)
    assert bus.write_word(30, 299) == 0x02
    assert bus.write_word(30, 701) == 0x02
    assert bus.write_word(30, 1024) == 0x0A
    assert bus.write_word(30, 300) == 0


def test_the_lock_protects_the_eeprom_until_power_is_cut(bus):
    assert bus.write(47, 1) == 0
    assert bus.write(3, 5) == 0x08
    assert bus.write(47, 0) == 0x08
    assert bus.write(25, 1) == 0


@pytest.mark.parametrize(
    ('level', 'answers'), [(0, [True, False, False]), (1, [True, True, False]), (2, [True] * 3)]
)
def test_return_level(bus, level, answers):
    bus.send(3, 16, level)
    replies = [bus.send(1), bus.send(2, 0, 1), bus.send(3, 25, 1)]
    assert [reply is not None for reply in replies] == answers


@pytest.mark.parametrize(
    ('code', 'parameters'),
    [(0, ()), (7, ()), (0x92, (0, 1, 0, 2)), (2, (0,)), (2, (0, 1, 2)), (3, ()), (3, (24,)),
     (4, (24,)), (5, ()), (1, (0,)), (6, (1,)), (0x83, (24, 1, 1, 1))],
)  # fmt: skip
def test_instructions_that_are_none(bus, code, parameters):
    assert bus.send(code, *parameters) == (0x40, b'')


def test_a_wrong_checksum_is_answered_as_such(bus):
    assert bus.raw(bytes.fromhex('FFFF0104020002F7')) == bytes.fromhex('FFFF010210EC')


def test_other_servos_are_not_ours(bus):
    assert bus.send(1, servo_id=2) is None


def test_broadcast_is_obeyed_and_not_answered(bus):
    assert bus.send(3, 25, 1, servo_id=0xFE) is None
    assert bus.read(25) == 1


@pytest.mark.parametrize('level', [0, 1, 2])
def test_a_broadcast_ping_is_answered_with_the_own_id(bus, level):
    bus.write(3, 9)
    bus.send(3, 16, level, servo_id=9)
    assert bus.raw(bytes.fromhex('FFFFFE0201FE')) == bytes.fromhex('FFFF090200F4')
    assert bus.raw(bytes.fromhex('FFFFFE0201FD')) is None


def test_a_registered_write_waits_for_action(bus):
    assert bus.send(4, 25, 1) == (0, b'')
    assert (bus.read(25), bus.read(44)) == (0, 1)
    assert bus.send(5, servo_id=0xFE) is None
    assert (bus.read(25), bus.read(44)) == (1, 0)
    assert bus.send(5) == (0x40, b'')


def test_a_bad_registered_write_is_refused_at_once(bus):
    assert bus.send(4, 25, 2) == (0x08, b'')
    assert bus.read(44) == 0


def test_sync_write_takes_its_own_part(bus):
    parts = (0x83, 30, 4, 2, 0, 1, 0, 2, 1, 0x00, 0x02, 0x50, 0x01)
    assert bus.send(*parts, servo_id=0xFE) is None
    assert (bus.read(30, 2), bus.read(32, 2)) == (0x200, 0x150)


def test_a_new_id_counts_after_the_answer(bus):
    assert bus.write(3, 9) == 0
    assert bus.send(1) is None
    assert bus.send(1, servo_id=9) == (0, b'')


@pytest.mark.parametrize(('return_delay', 'expected_us'), [(250, 720.0), (0, 220.0)])
def test_block_read_at_1_mbps(return_delay, expected_us):
    bus = Bus(return_delay=return_delay)
    bus.send(2, 36, 8)
    assert (bus.clock() - START) / 1e3 == pytest.approx(expected_us, abs=0.01)


def test_bit_rate_of_the_factory_and_of_the_register():
    bus = Bus(baud=34)
    bus.send(1)  # 6 bytes there and 6 back
    first = bus.clock() - START
    assert first == pytest.approx(12 * 10 / (2e6 / 35) * 1e9, rel=1e-6)
    bus.write(4, 1)
    before = bus.clock()
    bus.send(1)
    assert bus.clock() - before == pytest.approx(120_000, abs=2)


def test_the_latency_timer_of_an_adapter_makes_62_hz():
    bus = Bus(latency_timer=0.016, return_delay=250)
    bus.send(2, 36, 8)
    begin = bus.clock()
    for _ in range(50):
        bus.send(2, 36, 8)
    assert 50e9 / (bus.clock() - begin) == pytest.approx(62.5)


def test_another_bit_rate_of_the_host_brings_silence(bus):
    bus.servo.host_bit_rate = 57600
    assert bus.send(1) is None
    bus.servo.host_bit_rate = 1_000_000
    assert bus.send(1) == (0, b'')


def test_motion_keeps_to_speed_and_acceleration(bus):
    """A move of 200 ticks: trapezoid of 200 rad/s^2 and 270 units of speed."""
    bus.write_word(32, 270)
    bus.write_word(30, 712)
    begin = bus.clock()
    speed, distance = 270 * UNIT, 200 * TICK
    duration = distance / speed + speed / 200.0
    bus.wait(duration / 2)
    assert bus.read(38, 2) == 270
    assert bus.read(46) == 1
    assert bus.read(36, 2) == pytest.approx(612, abs=1)
    bus.wait(duration / 2)
    assert bus.clock() - begin < 1.01 * duration * 1e9
    assert (bus.read(36, 2), bus.read(38, 2), bus.read(46)) == (712, 0, 0)
    assert bus.pitch() == pytest.approx(200 * TICK)


def test_falling_ticks_are_clockwise(bus):
    bus.write_word(32, 100)
    bus.write_word(30, 400)
    bus.wait(0.1)
    assert bus.read(38, 2) == 1024 + 100
    assert bus.read(36, 2) < 512


def test_speed_0_is_126_rpm_at_12_volts(bus):
    bus.write_word(30, 1023)
    bus.wait(0.1)
    assert bus.read(38, 2) == min(round(126 / 0.111), 1023)
    speed = bus.motion.velocity(np.array([bus.clock()]))[0]
    assert speed == pytest.approx(126 * 2 * math.pi / 60)


def test_an_inverted_servo_pitches_down_with_rising_ticks():
    bus = Bus(invert=True)
    assert bus.read(36, 2) == 512
    bus.write_word(30, 412)
    bus.wait(1)
    assert bus.pitch() == pytest.approx(100 * TICK)
    assert bus.read(36, 2) == 412


@given(st.integers(0, 1023))
@settings(max_examples=30)
def test_positions_are_the_nearest_tick(goal):
    bus = Bus()
    bus.write_word(30, goal)
    bus.wait(1)
    assert bus.read(36, 2) == goal
    assert bus.pitch() == pytest.approx((goal - 512) * TICK)


def test_without_torque_it_stops(bus):
    bus.write_word(32, 100)
    bus.write_word(30, 1023)
    assert bus.read(24) == 1  # a goal turns the torque on
    bus.wait(0.2)
    assert bus.write(24, 0) == 0
    bus.wait(0.2)
    here = bus.read(36, 2)
    bus.wait(1)
    assert bus.read(36, 2) == here < 1023
    bus.write(24, 1)
    bus.wait(3)
    assert bus.read(36, 2) == 1023


def test_a_new_goal_in_mid_move_is_followed(bus):
    bus.write_word(32, 300)
    bus.write_word(30, 900)
    bus.wait(0.1)
    bus.write_word(30, 100)
    bus.wait(2)
    assert bus.read(36, 2) == 100


def test_wheel_mode_turns_without_end(bus):
    bus.write_word(8, 0)
    bus.write_word(32, 500)
    bus.write(24, 1)
    bus.wait(1)
    start = bus.pitch()
    bus.wait(2)
    assert bus.pitch() - start == pytest.approx(2 * 500 * UNIT, rel=1e-3)
    assert 0 <= bus.read(36, 2) <= 1023
    bus.write_word(32, 1024 + 200)
    bus.wait(1)
    assert bus.read(38, 2) == 1024 + 200
    bus.write_word(32, 0)
    bus.wait(1)
    assert bus.read(46) == 0


def test_overload_cuts_the_torque_until_the_limit_is_written_again(bus):
    bus.write_word(32, 100)
    bus.write_word(30, 1023)
    bus.wait(0.1)
    bus.servo.motor.load = 1.2
    assert bus.send(1) == (0x20, b'')
    bus.wait(0.1)
    error, data = bus.send(2, 34, 13)
    assert error == 0x20
    assert int.from_bytes(data[:2], 'little') == 0
    assert data[12] == 0  # not moving
    bus.servo.motor.load = 0.5
    assert bus.send(1) == (0x20, b'')
    assert bus.write_word(34, 1023) == 0
    assert bus.read(40, 2) == round(0.5 * 1023)
    bus.wait(5)
    assert bus.read(36, 2) == 1023


def test_alarms_are_combined_and_only_some_shut_down(bus):
    bus.write_word(30, 600)
    bus.servo.motor.voltage = 5.9
    assert bus.send(1) == (0x01, b'')
    bus.servo.motor.temperature = 81
    assert bus.write_word(30, 1024) == 0x01 | 0x02 | 0x04 | 0x08
    bus.servo.motor.temperature, bus.servo.motor.voltage = 40, 12
    assert bus.send(2, 34, 2) == (0, b'\x00\x00')


def test_shutdown_is_only_for_the_causes_that_are_set(bus):
    bus.write(18, 0)
    bus.write_word(30, 600)
    bus.servo.motor.temperature = 99
    assert bus.send(1) == (0x04, b'')
    assert bus.send(2, 34, 2) == (0x04, b'\xff\x03')


@pytest.mark.parametrize(('shutdown', 'limit'), [(0x7F, 0), (0x08, 0), (0x24, 1023)])
def test_a_refused_request_shuts_down_if_it_is_among_the_causes(bus, shutdown, limit):
    bus.write(18, shutdown)
    assert bus.write(25, 2) == 0x08
    assert bus.read(34, 2) == limit


def test_jitter_makes_turns_late():
    turns = []
    for jitter in (0.0, 0.05):
        bus = Bus(jitter=jitter)
        bus.write_word(32, 300)
        bus.write_word(30, 900)
        bus.wait(0.1)
        bus.write_word(30, 100)
        bus.wait(2e-3)
        before = bus.motion.velocity(np.array([bus.clock()]))[0]
        turns.append(before)
    assert turns[0] < turns[1]


@settings(max_examples=60)
@given(st.lists(st.binary(max_size=100), max_size=8))
def test_garbage_never_crashes_it_and_after_a_pause_it_answers(pieces):
    bus = Bus(start_ns=START)
    for piece in pieces:
        bus.port.write(piece)
        bus.wait(0.01)
    bus.wait(0.2)
    bus.port.reset_input_buffer()
    own_id = bus.servo.table.read(3, 1)[0]
    bus.servo.table.write(47, b'\x00')
    reply = bus.send(1, servo_id=own_id)
    assert reply is not None
    assert reply[1] == b''


@settings(max_examples=100)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([1, 2, 3, 4, 5, 0x83]), st.lists(st.integers(0, 255), max_size=6)
        ),
        max_size=10,
    )
)
def test_any_sound_packets_leave_a_servo_that_answers(packets):
    bus = Bus()
    for code, parameters in packets:
        bus.send(code, *parameters, servo_id=bus.servo.table.read(3, 1)[0])
    assert bus.send(1, servo_id=bus.servo.table.read(3, 1)[0]) is not None
