from contextlib import suppress
from functools import partial
import math

from nodlidar_common.errors import DeviceError, PortError
from nodlidar_servo.bus.replies import LateReplyError, NoAnswerError, ReplyError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.servo import Servo
from nodlidar_sim.devices import rx_table as table
from nodlidar_sim.devices.rx_motor import SPEED_UNIT, TICK
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.servo_models import EMULATED
import pytest
from servo_bench import ServoBench

ONE_MEGABIT = 1
CONFIG = ServoConfig()


Bench = partial(ServoBench, RxServoEmulator, CONFIG, baud=ONE_MEGABIT)


def test_a_servo_from_the_factory_is_set_up():
    bench = Bench()
    bench.connect(ServoConfig(torque_limit=0.5))
    assert bench[table.RETURN_DELAY] == 0
    assert bench[table.TORQUE_LIMIT] == 512
    assert bench[table.TORQUE_ENABLE] == 0


COARSE, FINE = (512, math.radians(300.0) / 1024, 0.111), (2048, math.tau / 4096, 0.114)


@pytest.mark.parametrize(
    ('model', 'number', 'steps', 'voltage'),
    [
        ('RX-24F', 24, COARSE, 12.0),
        ('RX-28', 28, COARSE, 18.5),
        ('RX-64', 64, COARSE, 18.5),
        ('AX-12A', 12, COARSE, 12.0),
        ('AX-18A', 18, COARSE, 12.0),
        ('MX-28', 29, FINE, 12.0),
    ],
)
def test_each_model_of_protocol_1_is_driven_in_its_own_steps(model, number, steps, voltage):
    bench = Bench(kind=EMULATED[model].emulator.keywords['kind'])
    middle, tick, rpm = steps
    servo = bench.connect(ServoConfig(model=model))
    assert (bench[table.MODEL], bench[table.CCW_LIMIT]) == (number, 2 * middle - 1)
    assert bench[table.TORQUE_LIMIT] == bench[table.MAX_TORQUE]
    servo.drive(0.6, 2.0)
    assert bench[table.GOAL] == middle + round(0.6 / tick)
    assert bench[table.MOVING_SPEED] == round(2.0 / (rpm * math.tau / 60.0))
    for _ in range(50):
        sample = servo.read()
    assert sample.velocity == pytest.approx(2.0, abs=rpm * math.tau / 60.0)
    assert sample.pitch == pytest.approx(bench.pitch(sample.stamp_ns), abs=tick)
    assert (sample.voltage, sample.status) == (voltage, 0)
    bench.pass_time(1.0)
    assert servo.read().pitch == pytest.approx(0.6, abs=tick)


def test_torque_left_on_by_a_crash_is_switched_off():
    bench = Bench()
    bench[table.TORQUE_ENABLE] = 1
    bench.connect()
    assert bench[table.TORQUE_ENABLE] == 0


def test_the_eeprom_is_only_written_if_need_be(monkeypatch):
    bench = Bench(return_delay=0)
    written = []
    obey = bench.emulator.table.write
    monkeypatch.setattr(
        bench.emulator.table, 'write', lambda at, data: written.append(at) or obey(at, data)
    )
    bench.connect()
    assert written
    assert min(written) >= table.EEPROM_END


def test_a_locked_eeprom_keeps_its_delay_and_the_stamps_stay_right():
    bench = Bench()
    bench[table.LOCK] = 1
    servo = bench.connect()
    assert bench[table.RETURN_DELAY] == 250
    sent_ns = bench.clock()
    assert servo.read().stamp_ns == sent_ns + 80_000 + 250_000


@pytest.mark.parametrize('level', [0, 1])
def test_a_servo_that_answers_no_writes_or_not_even_reads_is_told_to(level):
    bench = Bench()
    bench[table.RETURN_LEVEL] = level
    bench.connect()
    assert bench[table.RETURN_LEVEL] == 2


def test_a_servo_that_confirms_no_writes_and_is_locked_is_told_as_such():
    bench = Bench()
    bench[table.RETURN_LEVEL], bench[table.LOCK] = 1, 1
    with pytest.raises(DeviceError, match=r'address 16, is 1.* and is locked'):
        bench.connect()


def test_another_model_is_named():
    bench = Bench()
    bench[table.MODEL] = 12
    with pytest.raises(DeviceError, match=r"'model' is RX-24F, but .* number 12 \(AX-12A\)"):
        bench.connect()


def test_wheel_mode_is_refused():
    bench = Bench()
    bench[table.CCW_LIMIT] = 0
    with pytest.raises(DeviceError, match=r'wheel mode.* setup`'):
        bench.connect()


def test_limits_in_the_servo_that_are_tighter_than_the_mounts_are_named():
    bench = Bench()
    bench[table.CCW_LIMIT] = 600
    named = r"'pitch_upper_limit' must be between .* and 0.4500.* setup`"
    with pytest.raises(DeviceError, match=named):
        bench.connect()


def test_limits_in_the_servo_that_leave_nothing_between_them_are_told():
    bench = Bench()
    bench[table.CW_LIMIT], bench[table.CCW_LIMIT] = 800, 200
    named = r'lower limit .* 800, is above the upper one, 200.* setup`'
    with pytest.raises(DeviceError, match=named):
        bench.connect()


def test_a_servo_that_is_allowed_no_torque_is_told():
    bench = Bench()
    bench[table.MAX_TORQUE] = 0
    with pytest.raises(DeviceError, match=r'maximum torque .*\(address 14\) is 0'):
        bench.connect()


def test_another_id_does_not_answer():
    with pytest.raises(NoAnswerError, match='ID 7 does not answer'):
        Bench().connect(ServoConfig(servo_id=7))


@pytest.mark.parametrize('invert', [False, True])
def test_a_sample_is_the_truth_at_its_stamp(invert):
    bench = Bench(invert=invert)
    servo = bench.connect(ServoConfig(invert=invert))
    servo.drive(0.7, 2.0)
    bench.pass_time(0.1)
    bench.emulator.motor.load = 0.25
    sample = servo.read()
    assert abs(sample.pitch - bench.pitch(sample.stamp_ns)) <= TICK / 2 + 1e-9
    assert sample.velocity == pytest.approx(2.0, abs=SPEED_UNIT)
    assert sample.load == pytest.approx(0.25, abs=1e-3)
    assert (sample.voltage, sample.temperature, sample.status) == (12.0, 35, 0)


@pytest.mark.parametrize(
    ('latency_timer', 'worst_ns'), [(0.0, 0), (0.001, 500_000), (0.016, 500_000)]
)
def test_stamps_are_within_half_a_usb_frame_of_the_measurement(
    latency_timer, worst_ns, monkeypatch
):
    bench = Bench(latency_timer=latency_timer)
    measured = []
    measure = bench.emulator.motor.measure
    monkeypatch.setattr(
        bench.emulator.motor, 'measure', lambda at: measured.append(at) or measure(at)
    )
    servo = bench.connect()
    for _ in range(50):
        bench.pass_time(0.01037)
        assert abs(servo.read().stamp_ns - measured[-1]) <= worst_ns


def test_an_alarm_comes_with_the_sample_and_a_new_connection_revives_the_motor():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.5, 1.0)
    bench.emulator.motor.load = 1.5
    assert servo.read().status == table.Errors.OVERLOAD
    assert bench[table.TORQUE_LIMIT] == 0
    bench.emulator.motor.load = 0.0
    assert servo.read().status == 0
    assert servo.shut_down == table.Errors.OVERLOAD
    assert bench.connect().shut_down == 0
    assert bench[table.TORQUE_LIMIT] == 1023


def test_drive_gives_goal_and_speed_and_torque():
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.3, 1.5)
    assert servo.torque
    assert bench[table.TORQUE_ENABLE] == 1
    assert bench[table.GOAL] == 512 - round(0.3 / TICK)
    assert bench[table.MOVING_SPEED] == round(1.5 / SPEED_UNIT)
    bench.pass_time(2.0)
    assert bench.pitch(bench.clock()) == pytest.approx(-0.3, abs=TICK / 2)


def test_no_speed_is_sent_as_the_slowest_not_as_uncontrolled():
    bench = Bench()
    bench.connect().drive(-0.3, 0.0)
    assert bench[table.MOVING_SPEED] == 1


def test_torque_counts_as_on_until_the_motor_confirms_that_it_is_off():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.5, 1.0)
    bench.faults.mute = True
    with pytest.raises(NoAnswerError):
        servo.set_torque(False)
    assert servo.torque
    bench.faults.mute = False
    servo.set_torque(False)
    assert not servo.torque


def test_torque_counts_as_on_from_the_first_goal_on_which_switches_it_on():
    bench = Bench()
    servo = bench.connect()
    bench.faults.mute = True  # what follows the goal fails
    with pytest.raises(NoAnswerError):
        servo.drive(0.5, 1.0)
    assert bench[table.TORQUE_ENABLE] == 1
    assert servo.torque


def test_disconnecting_takes_the_torque_off():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.5, 1.0)
    servo.disconnect()
    assert not servo.torque
    assert bench[table.TORQUE_ENABLE] == 0


def test_disconnecting_a_servo_that_cannot_be_heard_or_is_gone_is_an_error():
    bench = Bench()
    servo = bench.connect()
    servo.drive(0.5, 1.0)
    bench.faults.mute = True
    with pytest.raises(DeviceError, match='did not confirm that its torque is off'):
        servo.disconnect()
    assert bench[table.TORQUE_ENABLE] == 0  # it was heard, though
    bench.port.unplug()
    with pytest.raises(PortError, match='went away'):
        servo.disconnect()


def test_a_servo_that_could_not_be_connected_is_left_alone():
    bench = Bench()
    bench[table.MODEL] = 12
    bench[table.TORQUE_ENABLE] = 1
    servo = Servo(bench.port, CONFIG, bench.clock)
    with pytest.raises(DeviceError):
        servo.connect()
    servo.disconnect()
    assert bench[table.TORQUE_ENABLE] == 1


@pytest.mark.parametrize('stall_ms', [5, 15, 25, 45, 55, 70, 95])
def test_after_a_stall_no_old_measurement_gets_a_new_time(stall_ms):
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.6, 3.0)
    bench.pass_time(0.05)
    bench.faults.stalled_until_ns = bench.clock() + stall_ms * 1_000_000
    samples = []
    for _ in range(20):
        with suppress(ReplyError):
            samples.append(servo.read())
        bench.pass_time(0.01)
    assert len(samples) >= 18 - stall_ms // 12
    unknown = 3.0 * 0.0005  # which part of a USB frame went by on which way
    for sample in samples:
        assert sample.pitch == pytest.approx(bench.pitch(sample.stamp_ns), abs=TICK / 2 + unknown)


@pytest.mark.parametrize('call', ['write', 'read'])
@pytest.mark.parametrize('stop_ms', [1.5, 5.0, 15.0, 100.0, 5000.0])
def test_a_host_that_stands_still_in_a_transaction_makes_no_wrong_stamp(
    call, stop_ms, monkeypatch
):
    bench = Bench()
    servo = bench.connect()
    servo.drive(-0.6, 3.0)
    bench.pass_time(0.05)
    servo.read()
    proceed = getattr(bench.port, call)

    def stop_before(argument):
        bench.pass_time(stop_ms * 1e-3)
        return proceed(argument)

    with monkeypatch.context() as patch:
        patch.setattr(bench.port, call, stop_before)
        with pytest.raises(LateReplyError):
            servo.read()
    bench.pass_time(0.01)
    sample = servo.read()
    assert sample.pitch == pytest.approx(bench.pitch(sample.stamp_ns), abs=TICK / 2 + 1e-9)


def test_a_line_that_holds_bytes_back_costs_samples_and_makes_no_wrong_stamps():
    bench = Bench(latency_timer=0.001)
    servo = bench.connect()
    servo.drive(-0.6, 1.0)
    bench.faults.to_device.jitter_ns = 13_000_000
    samples = []
    for _ in range(70):
        with suppress(ReplyError):
            samples.append(servo.read())
        bench.pass_time(0.01)
    assert 2 < len(samples) < 35
    for sample in samples:
        assert sample.pitch == pytest.approx(bench.pitch(sample.stamp_ns), abs=TICK / 2 + 0.0015)


def test_a_pulled_cable_is_a_port_error():
    bench = Bench()
    servo = bench.connect()
    bench.port.unplug()
    with pytest.raises(PortError):
        servo.read()
