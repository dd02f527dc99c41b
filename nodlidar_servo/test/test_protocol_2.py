"""Servos of Protocol 2.0: set up, measured and driven as those of 1.0."""

from dataclasses import replace
from functools import partial
import math
import re

from nodlidar_common.errors import DeviceError
from nodlidar_servo.bus.packets import PROTOCOL_1, PROTOCOL_2
from nodlidar_servo.bus.replies import NoAnswerError, RefusedError, status_names
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.device.torque_off import torque_off
from nodlidar_servo.models.control_table import TABLE_1, TABLE_2
from nodlidar_servo.models.models import MODELS
from nodlidar_sim.devices import x_table as table
from nodlidar_sim.devices.servo_models import EMULATED, make_emulator
from nodlidar_sim.devices.x_servo import TICK, XServoEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np
import pytest
from servo_bench import ServoBench, START_NS

ONE_MEGABIT = 3
CONFIG = ServoConfig(model='XL430-W250')


Bench = partial(ServoBench, XServoEmulator, CONFIG, baud=ONE_MEGABIT)


def connected(emulator, config):
    clock = VirtualClock(START_NS)
    servo = Servo(VirtualPort(emulator, clock), config, clock)
    servo.connect()
    return servo


def test_a_servo_from_the_factory_is_set_up():
    bench = Bench()
    bench[table.TORQUE_ENABLE] = 1  # left on by a crash
    servo = bench.connect(ServoConfig(model='XL430-W250', torque_limit=0.4))
    assert (bench[table.RETURN_DELAY], bench[table.TORQUE_ENABLE]) == (0, 0)
    assert bench[table.GOAL_PWM] == 354  # of 885
    limits = servo.limits
    assert (limits.temperature, limits.voltage_min, limits.voltage_max) == (72, 6.0, 14.0)


@pytest.mark.parametrize(('name', 'number'), [(m.name, m.number) for m in MODELS.values()])
def test_models_are_told_apart(name, number):
    if MODELS[name].table is TABLE_2:
        bench = Bench(kind=EMULATED[name].emulator.keywords['kind'])
        assert not bench.connect(ServoConfig(model=name)).torque
        other = ServoConfig(model='MX-28-2' if name != 'MX-28-2' else 'XL330-M288')
        with pytest.raises(DeviceError, match=f'model number {number} .{name}'):
            bench.connect(other)


@pytest.mark.parametrize('model', ['XL330-M288', 'XL330-M077'])
def test_an_xl330_has_5_volts_and_reports_its_current(model):
    emulator = make_emulator(model, IdealServo(0.2), 0.0)
    servo = connected(emulator, ServoConfig(model=model))
    assert (servo.limits.voltage_min, servo.limits.voltage_max) == (3.5, 7.0)
    emulator.motor.load = 0.4  # of its torque, as 700 of 1750 mA
    sample = servo.read()
    assert sample.load == pytest.approx(0.4)
    assert sample.voltage == pytest.approx(5.0)
    assert emulator.table[table.LOAD] == 700


@pytest.mark.parametrize(
    ('model', 'asked', 'gain'),
    [
        ('XL330-M288', 0, 1200),
        ('XL330-M077', 0, 1200),
        ('XL330-M288', 700, 700),
        ('XL430-W250', 0, 640),
        ('XL430-W250', 900, 900),
        ('MX-28-2', 0, 850),
    ],
)
def test_the_position_gain_is_as_asked_or_as_the_model_needs(model, asked, gain):
    emulator = make_emulator(model, IdealServo(0.2), 0.0)
    connected(emulator, ServoConfig(model=model, position_gain=asked))
    assert emulator.table[table.P_GAIN] == gain


def test_an_xl330_gives_way_to_a_lidar_by_the_inverse_of_its_gain():
    beyond = {}  # as the lidar is above the axis
    for gain in (400, 1200):
        motion = PhysicalServo(replace(load_servo('xl330'), encoder_nonlinearity=0.0), 0.6)
        emulator = make_emulator('XL330-M288', motion, 0.0)
        servo = connected(emulator, ServoConfig(model='XL330-M288', position_gain=gain))
        servo.drive(0.6, 1.0)
        for _ in range(1000):
            sample = servo.read()
        beyond[gain] = sample.pitch - 0.6
    assert beyond[400] > 0.05
    assert beyond[400] / beyond[1200] == pytest.approx(3.0, rel=0.2)


def test_a_sample_is_what_the_shaft_does():
    bench = Bench()
    servo = bench.connect()
    bench.emulator.motor.load = -0.25
    servo.drive(0.6, 2.0)
    for _ in range(100):
        sample = servo.read()
    assert sample.velocity == pytest.approx(2.0, abs=0.03)
    assert sample.load == pytest.approx(-0.25, abs=0.01)
    assert (sample.voltage, sample.temperature, sample.status) == (12.0, 35, 0)
    at = float(bench.motion.position(np.array([sample.stamp_ns]))[0])
    assert sample.pitch == pytest.approx(at, abs=TICK)


def test_the_speed_is_that_of_the_profile():
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.3, 1.5)
    assert bench[table.PROFILE_VELOCITY] == round(1.5 / (0.229 * 2 * math.pi / 60))
    assert bench[table.GOAL] == 2048 - round(0.3 / TICK)
    assert (bench[table.TORQUE_ENABLE], servo.torque) == (1, True)
    servo.disconnect()
    assert bench[table.TORQUE_ENABLE] == 0


@pytest.mark.parametrize(
    ('register', 'value', 'words'),
    [
        (table.OPERATING_MODE, 1, 'operating mode 1 .*position control'),
        (table.DRIVE_MODE, 4, 'drive mode 4'),
        (table.MAX_POSITION, 2100, "'pitch_upper_limit' must be between"),
        (table.PWM_LIMIT, 0, r'maximum torque of the servo \(address 36\) is 0'),
    ],
)
def test_what_cannot_nod_is_named(register, value, words):
    bench = Bench()
    bench[register] = value
    with pytest.raises(DeviceError, match=words):
        bench.connect()


def test_an_overload_is_named_and_the_servo_is_started_anew():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.6, 2.0)
    bench.emulator.motor.load = 1.5
    servo.read()
    sample = servo.read()
    assert status_names(sample.status) == 'overload'
    assert servo.shut_down == sample.status
    assert bench[table.TORQUE_ENABLE] == 0
    with pytest.raises(RefusedError):
        servo.set_torque(True)
    bench.emulator.motor.load = 0.0
    with pytest.raises(DeviceError, match=r'shut itself down \(overload\); it was started anew'):
        bench.connect()
    again = bench.connect()
    assert again.read().status == 0


def test_an_alarm_that_shuts_nothing_down_does_not_keep_the_servo_from_being_set_up():
    bench = Bench()
    input_voltage = 0x01
    assert not bench[table.SHUTDOWN] & input_voltage
    bench[table.HARDWARE_ERROR] = input_voltage
    servo = bench.connect()
    servo.drive(0.6, 2.0)
    assert bench[table.TORQUE_ENABLE] == 1
    assert status_names(servo.read().status) == 'input voltage'
    assert not servo.shut_down


def test_a_servo_that_answers_nothing_is_made_to():
    bench = Bench()
    bench[table.RETURN_LEVEL] = 0
    bench.connect()
    assert bench[table.RETURN_LEVEL] == 2


def test_a_servo_whose_host_dies_stops_and_can_be_driven_again():
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.6, 0.5)
    servo.read()
    heard_ns = bench.clock()
    while (event := bench.emulator.next_event_ns()) is not None:  # nobody asks any more
        bench.clock.advance_to(event)
        bench.emulator.transmit(event)
    assert bench[table.WATCHDOG] == 0xFF
    assert bench.clock() - heard_ns == pytest.approx(0.5e9, abs=5e6)
    later = np.array([bench.clock() + 10**8, bench.clock() + 10**10])
    moved = bench.motion.position(later)
    assert moved[0] == moved[1] == pytest.approx(0.2 - 0.5 * 0.5, abs=0.02)
    with pytest.raises(RefusedError):
        servo._bus.write(table.GOAL.address, bytes(4))
    bench.clock.advance_to(int(later[1]))
    again = bench.connect()
    again.drive(0.3, 2.0)
    for _ in range(900):
        again.read()
    assert again.read().pitch == pytest.approx(0.3, abs=TICK)
    again.disconnect()
    assert (bench[table.TORQUE_ENABLE], bench[table.WATCHDOG]) == (0, 0)


@pytest.mark.parametrize('pause', [0.45, 0.55, 2.0])
def test_a_servo_is_driven_again_after_its_host_was_silent(pause):
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.6, 0.5)
    servo.read()
    bench.pass_time(pause)
    servo.read()
    servo.drive(0.3, 2.0)
    for _ in range(900):
        sample = servo.read()
    assert sample.pitch == pytest.approx(0.3, abs=TICK)


def test_torque_that_is_off_is_no_error_when_the_watchdog_confirms_nothing():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.3, 2.0)
    receive, requests = bench.faults.receive, []
    no_watchdog = PROTOCOL_2.encode(1, 3, PROTOCOL_2.number(table.WATCHDOG.address) + b'\0')

    def receive_but_lose_a_reply(data, now_ns):
        bench.faults.mute = data == no_watchdog
        requests.append(data)
        receive(data, now_ns)

    bench.faults.receive = receive_but_lose_a_reply
    servo.disconnect()
    assert requests.count(torque_off(1, TABLE_2).request) == 1
    assert requests.count(no_watchdog) == 8
    assert not servo.torque
    assert (bench[table.TORQUE_ENABLE], bench[table.WATCHDOG]) == (0, 0)


def test_another_protocol_does_not_answer():
    with pytest.raises(NoAnswerError):
        Bench().connect(ServoConfig(model='RX-24F'))


@pytest.mark.parametrize('control', [TABLE_1, TABLE_2])
def test_the_confirmation_of_a_stop_is_recognised_with_any_alarm(control):
    packets = control.packets
    expected = torque_off(1, control).confirmation
    for status in range(256):
        confirmed = re.search(expected, packets.encode_answer(1, status)) is not None
        assert confirmed == (not packets.refusal(status))
    assert not re.search(expected, packets.encode_answer(2, 0))


def test_packets_are_those_of_the_manuals():
    assert PROTOCOL_1.encode(1, 1, b'') == bytes.fromhex('FFFF010201FB')
    read = PROTOCOL_2.encode(1, 2, PROTOCOL_2.number(132) + PROTOCOL_2.number(4))
    assert read == bytes.fromhex('FFFFFD00 01 0700 02 84000400 1D15')
    answer = PROTOCOL_2.answer(bytes.fromhex('FFFFFD00 01 0800 55 00 A6000000 8CC0'))
    assert (answer.servo_id, answer.status, answer.data) == (1, 0, b'\xa6\x00\x00\x00')
