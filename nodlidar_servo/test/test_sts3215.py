"""The Feetech STS3215: set up, measured and driven as the Dynamixels, and found by `setup`."""

from contextlib import contextmanager
import math
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import DeviceError
from nodlidar_servo.bus.packets import PROTOCOL_1, PROTOCOL_STS
from nodlidar_servo.bus.replies import status_names
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.models.sts_table import TABLE_STS
from nodlidar_servo.setup.dialogue import Dialogue, Wish
from nodlidar_sim.devices import sts_table as table
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.sts_servo import BIT_RATES, StsEmulator, TICK
from nodlidar_sim.ports.virtual_port import VirtualPort
import numpy as np
import pytest
from servo_bench import ServoBench

CONFIG = ServoConfig(model='STS3215')


class Bench(ServoBench):
    """An STS3215, or another servo, that `setup` can set up."""

    def __init__(self, kind=StsEmulator, **options):
        super().__init__(kind, CONFIG, **options)

    @contextmanager
    def open_at(self, rate):
        self.emulator.host_bit_rate = rate
        yield VirtualPort(self.emulator, self.clock)

    def set_up(self):
        return Dialogue(self.open_at, lambda question: True, lambda line: None).set_up(
            Wish(level=False)
        )


def test_a_servo_is_set_up():
    bench = Bench(return_delay=250)
    bench[table.TORQUE_ENABLE] = 1  # left on by a crash
    servo = bench.connect(ServoConfig(model='STS3215', torque_limit=0.4))
    assert (bench[table.RETURN_DELAY], bench[table.TORQUE_ENABLE]) == (0, 0)
    assert bench[table.TORQUE_LIMIT] == 400
    limits = servo.limits
    assert (limits.temperature, limits.voltage_min, limits.voltage_max) == (70, 4.0, 14.0)


def test_a_sample_is_what_the_shaft_does():
    bench = Bench()
    servo = bench.connect()
    bench.emulator.motor.load = -0.25
    servo.drive(-0.6, 2.0)
    for _ in range(100):
        sample = servo.read()
    assert sample.velocity == pytest.approx(-2.0, abs=0.03)
    assert sample.load == pytest.approx(-0.25, abs=0.01)
    assert (sample.voltage, sample.temperature, sample.status) == (7.4, 35, 0)
    at = float(bench.motion.position(np.array([sample.stamp_ns]))[0])
    assert sample.pitch == pytest.approx(at, abs=TICK)


def test_the_bytes_of_a_goal_are_those_of_the_memory_table():
    """One block from address 41 on: acceleration, goal, time, speed in steps per second."""
    goal = TABLE_STS.goal(2048, 1500)
    assert goal == bytes.fromhex('00 0008 0000 DC05')
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.3, 1.5)
    assert bench[table.GOAL] == 2048 - round(0.3 / (2 * math.pi / 4096))
    assert bench[table.GOAL_SPEED] == round(1.5 * 4096 / (2 * math.pi))
    assert (bench[table.TORQUE_ENABLE], servo.torque) == (1, True)
    servo.disconnect()
    assert bench[table.TORQUE_ENABLE] == 0


@given(st.integers(-32767, 32767), st.integers(-32767, 32767), st.integers(-1023, 1023))
def test_signs_are_bits(position, speed, load):
    words = [abs(position) | 0x8000 * (position < 0), abs(speed) | 0x8000 * (speed < 0)]
    data = struct.pack('<HHHBB', *words, abs(load) | 0x400 * (load < 0), 74, 35)
    present = TABLE_STS.parse_present(data)
    assert (present.position, present.speed, present.load) == (position, speed, load)
    assert (present.voltage, present.temperature) == (7.4, 35)


@pytest.mark.parametrize(
    ('register', 'value', 'words'),
    [
        (table.MODE, 1, 'operating mode 1 .*position control'),
        (table.MAX_POSITION, 2100, "'pitch_upper_limit' must be between"),
        (table.MAX_POSITION, 0, 'multi-turn mode'),
        (table.MAX_TORQUE, 0, r'maximum torque of the servo \(address 16\) is 0'),
    ],
)
def test_what_cannot_nod_is_named(register, value, words):
    bench = Bench()
    bench[register] = value
    with pytest.raises(DeviceError, match=words):
        bench.connect()


def test_an_overload_is_named_and_ends_with_a_new_connection():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.6, 2.0)
    bench.emulator.motor.load = 1.5
    servo.read()
    sample = servo.read()
    assert status_names(sample.status) == 'overload'
    assert servo.shut_down == sample.status
    assert bench[table.TORQUE_ENABLE] == 0
    bench.emulator.motor.load = 0.0
    servo.set_torque(False)
    servo.drive(0.6, 2.0)
    servo.read()
    assert bench[table.TORQUE_ENABLE] == 0  # it does not start by itself
    again = bench.connect()
    again.drive(0.6, 2.0)
    assert again.read().status == 0
    assert bench[table.TORQUE_ENABLE] == 1


def test_no_status_is_a_refusal():
    assert not any(PROTOCOL_STS.refusal(status) for status in range(256))
    assert status_names(PROTOCOL_STS.alarms(0x26)) == 'position sensor, overheating, overload'


def test_a_servo_that_confirms_nothing_is_made_to():
    bench = Bench()
    bench[table.RETURN_LEVEL] = 0
    bench.connect()
    assert bench[table.RETURN_LEVEL] == 1


@settings(max_examples=15)
@given(st.integers(0, 252), st.integers(0, 7))
def test_setup_finds_it_and_what_it_sets_outlasts_the_supply(servo_id, code):
    bench = Bench(servo_id=servo_id, baud=code, return_delay=250)
    bench[table.MODE] = 1
    bench.emulator.table.save()
    result = bench.set_up()
    assert (result.before.found.servo_id, result.before.found.baud_rate) == (
        servo_id, pytest.approx(BIT_RATES[code], rel=0.03),
    )  # fmt: skip
    assert result.before.model.name == 'STS3215'
    bench.emulator.table.power_up()
    ends = 2048 - 522, 2048 + 522  # 0.8 rad of 0.00153 rad
    assert (bench[table.MIN_POSITION], bench[table.MAX_POSITION]) == ends
    assert (bench[table.ID], bench[table.BAUD], bench[table.MODE]) == (1, 0, 0)
    assert (bench[table.RETURN_DELAY], bench[table.LOCK]) == (0, 1)
    assert bench.set_up().changes == []
    bench.connect()


def test_an_interrupted_setup_leaves_the_settings_locked(monkeypatch):
    bench = Bench(servo_id=7)
    bench[table.LOCK] = 1
    write = bench.emulator.table.write

    def interrupted(address, data):
        if address == table.MAX_POSITION.address:
            raise KeyboardInterrupt
        return write(address, data)

    monkeypatch.setattr(bench.emulator.table, 'write', interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.set_up()
    assert bench[table.LOCK] == 1


def test_a_dynamixel_whose_id_and_rate_look_like_the_model_number_is_none():
    bench = Bench(RxServoEmulator, servo_id=777 % 256, baud=777 // 256)
    before = bench.set_up().before
    assert (before.model.name, before.found.packets) == ('RX-24F', PROTOCOL_1)
