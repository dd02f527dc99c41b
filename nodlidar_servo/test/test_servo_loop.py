import contextlib
import itertools

from hypothesis import example, given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError, PortError
from nodlidar_common.nod import Nod
from nodlidar_servo.bus.replies import CorruptReplyError, LateReplyError, NoAnswerError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.following import Following
from nodlidar_servo.models.control_table import TABLE_1
from nodlidar_servo.models.models import MODELS
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.servo_loop import LoopFigures, LOST_AFTER, Schedule, ServoLoop
from nodlidar_sim.devices import rx_table as table
from nodlidar_sim.devices import x_table
from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.devices.rx_motor import SPEED_UNIT, TICK
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.x_servo import XServoEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np
import pytest

START_NS = 1_800_000_000_000_000_000
SWEEP = 4001 * 0.1 / 1024
NOD = Nod(-0.6136, 0.6136, SWEEP, 4001, START_NS)
CONFIG = ServoConfig()


class Bench:
    """A loop on an emulated servo in virtual time, with a commander that can fall silent."""

    def __init__(self, latency_timer=0.0, rate=100.0, motion=None, config=CONFIG):
        self.motion = motion or IdealServo(0.2, history=1e6)
        if MODELS[config.model].table is TABLE_1:
            self.emulator = RxServoEmulator(self.motion, baud=1, latency_timer=latency_timer)
        else:
            self.emulator = XServoEmulator(self.motion, baud=3, latency_timer=latency_timer)
        self.faults = FaultyDevice(self.emulator, seed=1)
        self.clock = VirtualClock(START_NS)
        self.port = VirtualPort(self.faults, self.clock)
        self.commands = NodCommands(config)
        self.figures = LoopFigures()
        self.following = Following(config)
        self.servo = Servo(self.port, config, self.clock)
        self.servo.connect()
        self.loop = ServoLoop(
            self.servo,
            self.commands,
            self.following,
            rate,
            self.figures,
            self.clock,
            self.sleep,
        )

    def sleep(self, duration_ns):
        self.clock.advance_to(self.clock() + duration_ns)

    def run(self, seconds, nod=NOD):
        """Return the samples of some seconds in which the nod is commanded all the time."""
        end_ns, samples = self.clock() + round(seconds * 1e9), []
        while self.clock() < end_ns:
            if nod is not None:
                self.commands.accept(nod, self.clock())
            samples += self.loop.cycle()
        return samples

    @property
    def torque(self):
        return bool(self.emulator.table[table.TORQUE_ENABLE])

    def turn_errors(self, first, last):
        """Return how far from its limit the servo is at each turn [rad]."""
        sweeps = np.arange(first, last)
        turns = np.array([NOD.reversal_time_ns(int(sweep)) for sweep in sweeps])
        limits = np.where(sweeps % 2 == 0, NOD.pitch_min, NOD.pitch_max)
        return np.abs(self.motion.position(turns) - limits)


@pytest.mark.parametrize('rate', [0.001, 0.01])
def test_swapped_bytes_that_look_like_an_alarm_are_no_shutdown(rate):
    bench = Bench()
    bench.run(2.0)
    bench.faults.swap_rate = rate
    bench.run(100.0)
    bench.faults.mend()
    bench.run(3.0)
    assert bench.servo.shut_down == 0
    assert bench.torque
    assert len(bench.run(5.0)) == 500


def test_samples_come_at_the_rate_and_are_the_truth_at_their_stamps():
    bench = Bench()
    samples = bench.run(10.0)
    stamps = np.array([sample.stamp_ns for sample in samples])
    write_ns = 13 * 10_000  # a turn's write may still be on the wire when the next read begins
    assert np.abs(np.diff(stamps) - 10_000_000).max() <= write_ns / 2
    assert abs(stamps[-1] - stamps[0] - (len(stamps) - 1) * 10_000_000) <= write_ns / 2
    assert bench.figures.missed_cycles == 0
    error = np.array([sample.pitch for sample in samples]) - bench.motion.position(stamps)
    assert np.abs(error).max() <= TICK / 2 + 1e-9


def test_turns_are_in_time_at_the_limits_for_as_long_as_it_runs():
    bench = Bench()
    bench.run(30.0)
    assert bench.turn_errors(3, 75).max() < TICK


def test_a_latency_timer_of_16_ms_gives_62_samples_per_second_with_right_stamps():
    bench = Bench(latency_timer=0.016)
    samples = bench.run(20.0)
    assert len(samples) / 20.0 == pytest.approx(62.0, abs=1.0)
    assert bench.figures.missed_cycles > 0
    stamps = np.array([sample.stamp_ns for sample in samples])
    error = np.array([sample.pitch for sample in samples]) - bench.motion.position(stamps)
    half_frame = 0.0005 * 4.0  # at 4 rad/s, faster than this nod
    assert np.abs(error).max() <= TICK / 2 + half_frame
    assert bench.turn_errors(3, 50).max() < 2 * TICK


def test_turns_that_the_adapter_delays_are_led_so_that_the_phase_is_right():
    bench = Bench(latency_timer=0.016)
    bench.run(20.0)
    begin_ns = bench.clock()
    bench.run(20.0)
    times = np.arange(begin_ns, bench.clock(), 100_000)
    position = bench.motion.position(times)
    crossings = times[:-1][np.diff(np.sign(position)) != 0]
    due = (np.round(NOD.sweeps(crossings) - 0.5) + 0.5) * SWEEP * 1e9 + START_NS
    late = (crossings - due) * 1e-9
    assert abs(late.mean()) < 0.001
    assert np.sqrt(np.mean(late**2)) < 0.003
    assert 0 < bench.commands.follow(bench.clock()).phase.lead_ns < 16_000_000


def test_torque_is_off_without_commands_and_comes_with_them():
    bench = Bench()
    assert bench.run(0.5, nod=None)
    assert not bench.torque
    bench.run(0.1)
    assert bench.torque


def test_torque_goes_off_when_commands_stop_and_on_when_they_resume():
    bench = Bench()
    bench.run(2.0)
    bench.run(0.55, nod=None)
    assert bench.torque
    samples = bench.run(0.1, nod=None)
    assert not bench.torque
    assert samples
    bench.run(2.0)
    assert bench.torque
    assert bench.turn_errors(11, 12).max() < TICK


def test_the_mount_is_never_left_on_the_way_from_one_nod_to_another():
    bench = Bench()
    bench.run(1.1)
    other = Nod(-0.1, 0.4, SWEEP, 4001, START_NS + 123_456_789)
    begin_ns = bench.clock()
    bench.run(2.0, nod=other)
    times = np.arange(begin_ns, bench.clock(), 1_000_000)
    assert np.abs(bench.motion.position(times)).max() <= 0.6136 + TICK / 2
    settled = bench.motion.position(times[800:])
    assert settled.min() == pytest.approx(-0.1, abs=TICK)
    assert settled.max() == pytest.approx(0.4, abs=TICK)


commands = st.tuples(
    st.builds(
        Nod,
        pitch_min=st.floats(-1.0, 0.05),
        pitch_max=st.floats(0.1, 1.0),
        sweep_duration=st.floats(0.05, 0.8),
        samples_per_sweep=st.just(4001),
        reference_time_ns=st.integers(START_NS - 10**9, START_NS + 10**9),
    ),
    st.floats(0.01, 0.6),
)


# 16 and 20 sweeps a second: no servo is on such a nod, so it may teach no lead.
HECTIC = [
    (Nod(0.0, 0.125, 0.0625, 4001, START_NS - 10**9), 0.40625),
    (Nod(0.0, 0.109375, 0.05, 4001, START_NS - 10**9), 0.3359375),
    (Nod(-0.03125, 0.3125, 0.5625, 4001, START_NS + 816_192_821), 0.5625),
]


# On the way to the third nod the servo is nearly in phase, which teaches no lead either.
ON_THE_WAY = [
    (Nod(0.0, 0.71875, 0.59375, 4001, START_NS + 774_736_515), 0.5),
    (Nod(0.0, 0.71875, 0.59375, 4001, START_NS + 774_668_029), 0.5),
    (Nod(0.0, 0.6875, 0.75, 4001, START_NS + 747_264_670), 0.5),
]


@settings(max_examples=20)
@given(st.lists(commands, min_size=2, max_size=8))
@example(HECTIC)
@example(ON_THE_WAY)
def test_no_sequence_of_commands_asks_for_more_than_mount_and_motor_can_do(sequence):
    config, bench = ServoConfig(), Bench()
    fastest = MODELS[config.model].max_speed
    for nod, seconds in sequence:
        with contextlib.suppress(ParameterError):
            bench.commands.accept(nod, bench.clock())
        end_ns = bench.clock() + round(seconds * 1e9)
        while bench.clock() < end_ns:
            bench.loop.cycle()
            if (tracker := bench.commands.follow(bench.clock())) is not None:
                goal = (bench.emulator.table[table.GOAL] - 512) * TICK
                followed = tracker.nod
                assert followed.pitch_min - TICK <= goal <= followed.pitch_max + TICK
                assert bench.emulator.table[table.MOVING_SPEED] * SPEED_UNIT <= fastest
    bench.run(3.5 * SWEEP)
    assert not bench.following.fault
    times = np.arange(START_NS, bench.clock(), 1_000_000)
    position, velocity = bench.motion.position(times), bench.motion.velocity(times)
    assert np.abs(position).max() <= config.pitch_upper_limit + TICK
    assert np.abs(np.diff(position)).max() <= fastest * 1e-3
    assert np.abs(velocity).max() <= fastest
    error = np.abs(position - NOD.pitch(times))[-round(SWEEP * 1e3) :]
    assert error.max() < NOD.speed**2 / 200.0  # what the turns make inevitable


def test_corrupted_bytes_cost_samples_that_are_counted_but_never_make_wrong_ones():
    bench = Bench()
    bench.faults.corrupt_rate = 0.01
    samples = bench.run(20.0)
    failures = bench.figures.failures
    assert set(failures) <= {'corrupt reply', 'no answer', 'impossible position'}
    assert failures['corrupt reply'] > 10
    assert len(samples) == bench.figures.samples > 1000
    stamps = np.array([sample.stamp_ns for sample in samples])
    error = np.array([sample.pitch for sample in samples]) - bench.motion.position(stamps)
    assert np.median(np.abs(error)) < TICK / 2
    assert bench.turn_errors(3, 50).max() < 0.05


@pytest.mark.parametrize('latency_timer', [0.0, 0.016])
@pytest.mark.parametrize('begin', [0.1, 0.3, 0.5])
def test_a_servo_that_falls_silent_is_given_up_within_a_second(begin, latency_timer):
    bench = Bench(latency_timer)
    bench.run(begin)
    bench.faults.mute = True
    silent_ns = bench.clock()
    with pytest.raises(NoAnswerError):
        bench.run(2.0)
    assert LOST_AFTER <= (bench.clock() - silent_ns) / 1e9 < 0.7


@pytest.mark.parametrize('lost', [1, 2, 3])
def test_a_cycle_without_replies_costs_one_sample(lost):
    bench = Bench(latency_timer=0.001)
    bench.run(1.0)
    for _ in range(lost):
        bench.faults.mute = True
        assert bench.loop.cycle() == []
    bench.faults.mute = False
    bench.run(0.2)
    assert bench.figures.failures == {'no answer': lost + 1}
    assert bench.figures.missed_cycles == 0


@pytest.mark.parametrize(
    ('model', 'registers', 'limit', 'torque', 'gain'),
    [
        ('RX-24F', table, table.TORQUE_LIMIT, table.TORQUE_ENABLE, None),
        ('XL430-W250', x_table, x_table.GOAL_PWM, x_table.TORQUE_ENABLE, x_table.P_GAIN),
    ],
)
def test_a_servo_whose_supply_dips_gets_torque_and_settings_again(
    model, registers, limit, torque, gain
):
    config = ServoConfig(model=model, torque_limit=0.5, position_gain=0 if gain is None else 900)
    bench = Bench(config=config)
    kept = [register for register in (limit, torque, gain) if register is not None]
    bench.run(1.0)
    before = [bench.emulator.table[register] for register in kept]
    bench.faults.mute = True
    bench.run(0.04)
    for register in registers.REGISTERS:
        if register.address >= registers.EEPROM_END:
            bench.emulator.table[register] = register.default
    assert [bench.emulator.table[register] for register in kept] != before
    bench.faults.mute = False
    bench.run(0.1)
    assert [bench.emulator.table[register] for register in kept] == before
    assert not bench.following.fault


def failing_at_first(read, error, times):
    def read_or_fail():
        nonlocal times
        measured, times = read(), times - 1
        if times >= 0:
            raise error('at first')
        return measured

    return read_or_fail


@pytest.mark.parametrize('error', [NoAnswerError, CorruptReplyError, LateReplyError])
def test_a_lost_or_late_reply_is_asked_for_again_in_the_same_cycle(error):
    bench = Bench(latency_timer=0.001)
    before = bench.run(1.0)[-1]
    bench.servo.read = failing_at_first(bench.servo.read, error, times=1)
    (after,) = bench.loop.cycle()
    assert 0 < after.stamp_ns - before.stamp_ns < 14_000_000
    assert bench.figures.failures == {error.reason: 1}
    assert bench.figures.missed_cycles == 0


def test_late_replies_are_asked_for_again_until_the_cycle_is_over():
    bench = Bench(latency_timer=0.001, rate=16.0)
    bench.run(1.0)
    bench.servo.read = failing_at_first(bench.servo.read, LateReplyError, times=5)
    begin_ns = bench.clock()
    (sample,) = bench.loop.cycle()
    assert sample.stamp_ns - begin_ns < 2 * 62_500_000
    assert bench.figures.failures == {'late reply': 5}
    assert bench.figures.missed_cycles == 0


@pytest.mark.parametrize(('of_reply', 'of_request'), [(0.005, 0.0), (0.0, 0.005)])
def test_a_lost_byte_of_a_reply_a_request_or_a_goal_costs_one_sample(of_reply, of_request):
    """The motor takes what follows for the rest of its packet unless that is ended."""
    bench = Bench(latency_timer=0.001)
    bench.faults.drop_rate, bench.faults.to_device.drop_rate = of_reply, of_request
    stamps = np.array([sample.stamp_ns for sample in bench.run(10.0)])
    bytes_per_sample = 14 if of_reply else 8 + 13
    assert len(stamps) > 1000 * (1.0 - 0.005) ** bytes_per_sample - 30
    assert np.diff(stamps).max() < 60_000_000
    assert bench.figures.missed_cycles == 0


def test_the_torque_goes_off_without_commands_also_when_no_reply_comes():
    bench = Bench()
    bench.run(1.0)
    bench.run(0.4, nod=None)
    bench.faults.mute = True
    bench.run(0.3, nod=None)
    assert not bench.torque


def test_a_pulled_cable_is_told_at_once():
    bench = Bench()
    bench.run(0.1)
    bench.port.unplug()
    with pytest.raises(PortError):
        bench.loop.cycle()


@pytest.mark.parametrize('step_s', [-3600, -25, 25, 3600])
@pytest.mark.parametrize('reading', range(5))
def test_a_clock_that_is_set_at_any_instant_stops_nothing(reading, step_s):
    readings = itertools.count()
    bench = Bench()
    slept = []

    def clock():
        return bench.clock() + (step_s * 10**9 if next(readings) > reading else 0)

    loop = ServoLoop(
        bench.servo,
        bench.commands,
        bench.following,
        100.0,
        bench.figures,
        clock,
        lambda duration_ns: slept.append(duration_ns) or bench.sleep(duration_ns),
        bench.clock,
    )
    bench.commands.accept(NOD, bench.clock())
    assert all(loop.cycle() for _ in range(50))
    assert bench.torque
    assert max(slept) <= 10_000_000
    assert bench.figures.missed_cycles == 0
    bench.sleep(600_000_000)
    assert loop.cycle()
    assert not bench.torque


def test_deadlines_do_not_drift():
    schedule = Schedule(100.0)
    assert schedule.advance(5) == (5, 0)
    for cycle in range(1, 1000):
        late = cycle * 10_000_000 + cycle * 7919 % 9_999_999
        assert schedule.advance(late) == (5 + cycle * 10_000_000, 0)


def test_a_clock_that_is_set_back_begins_anew():
    schedule = Schedule(100.0)
    schedule.advance(10**12)
    assert schedule.advance(5) == (5, 0)
    assert schedule.advance(6) == (10_000_005, 0)


def test_whole_periods_that_have_passed_are_skipped_and_counted():
    schedule = Schedule(100.0)
    schedule.advance(0)
    assert schedule.advance(35_000_000) == (30_000_000, 2)
    assert schedule.advance(36_000_000) == (40_000_000, 0)


@pytest.mark.parametrize('delay_ms', [21, 30, 45])
def test_a_servo_whose_replies_all_come_late_has_no_torque_until_they_are_in_time(delay_ms):
    bench = Bench(latency_timer=0.001)
    bench.run(1.0)
    bench.faults.delay_ns = delay_ms * 1_000_000
    bench.run(LOST_AFTER + 0.2)
    assert not bench.torque
    assert not bench.servo.torque
    assert bench.loop.progress is None
    assert bench.figures.failures[LateReplyError.reason] > 5
    bench.faults.delay_ns = 0
    bench.run(0.5)
    assert bench.torque
    assert bench.loop.progress is not None


def test_one_late_reply_after_a_pause_of_the_host_keeps_the_torque():
    bench = Bench(latency_timer=0.001)
    bench.run(1.0)
    read = bench.servo.read

    def paused():
        bench.sleep(550_000_000)
        bench.servo.read = read
        raise LateReplyError('paused')

    bench.servo.read = paused
    bench.loop.cycle()
    assert bench.torque


@pytest.mark.parametrize('delay_ms', range(20, 500, 20))
def test_replies_that_all_come_late_are_never_those_of_later_requests(delay_ms):
    bench = Bench(latency_timer=0.001)
    bench.run(1.0)
    bench.faults.delay_ns = delay_ms * 1_000_000
    samples, end_ns = [], bench.clock() + 1_000_000_000
    with contextlib.suppress(NoAnswerError):
        while bench.clock() < end_ns:
            bench.commands.accept(NOD, bench.clock())
            samples += bench.loop.cycle()
    assert bench.figures.failures.total() > 0
    assert samples == []
