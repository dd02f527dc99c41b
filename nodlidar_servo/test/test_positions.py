from nodlidar_common.nod import Nod
from nodlidar_servo.bus.replies import PositionError
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.positions import PositionCheck
from nodlidar_servo.models.models import MODELS
from nodlidar_sim.devices.rx_motor import TICK
import numpy as np
import pytest
from test_servo_loop import Bench

MODEL = MODELS['RX-24F']
START_NS = 1_800_000_000_000_000_000
PERIOD_NS = 10_000_000


def accepted(ticks):
    """Return which of some positions, one in each period, are accepted."""
    check, verdicts = PositionCheck(MODEL, ServoConfig().acceleration), []
    for index, tick in enumerate(ticks):
        try:
            check.accept(START_NS + index * PERIOD_NS, tick)
        except PositionError:
            verdicts.append(False)
        else:
            verdicts.append(True)
    return verdicts


@pytest.mark.parametrize('tick', [1024, 4096, 60000, 65535])
def test_a_tick_that_the_model_has_not_is_refused_however_long_it_lasts(tick):
    assert accepted([512] + 200 * [tick] + [512]) == [True] + 200 * [False] + [True]


@pytest.mark.parametrize('spike', [15, 40, 200, -15, -40, -200])
@pytest.mark.parametrize('speed', [0, 6, -6])
def test_a_spike_is_refused_and_what_comes_after_it_is_not(spike, speed):
    ticks = [512 + speed * index for index in range(20)]
    ticks[10] += spike
    assert accepted(ticks) == [index != 10 for index in range(20)]


@pytest.mark.parametrize('jump', [-400, 60, 400])
def test_a_jump_that_lasts_is_believed_within_a_fifth_of_a_second(jump):
    verdicts = accepted(50 * [512] + 50 * [512 + jump])
    assert not verdicts[50]
    assert all(verdicts[70:])


@pytest.mark.parametrize('acceleration', [200.0, 300.0])
def test_whatever_a_servo_does_within_its_acceleration_is_believed(acceleration):
    rng, pitch, velocity, ticks = np.random.default_rng(1), 0.0, 0.0, []
    for _ in range(2000):
        velocity += rng.choice([-1, 1]) * acceleration * 0.01
        velocity = float(np.clip(velocity, -MODEL.max_speed, MODEL.max_speed))
        pitch += velocity * 0.01
        if abs(pitch) > 2.4:
            pitch, velocity = float(np.clip(pitch, -2.4, 2.4)), 0.0
        ticks.append(512 + round(pitch / TICK))
    assert all(accepted(ticks))


def test_a_clock_that_is_set_back_makes_no_position_impossible():
    check = PositionCheck(MODEL, 200.0)
    check.accept(START_NS, 512)
    check.accept(START_NS - 3600 * 10**9, 612)
    check.accept(START_NS - 3600 * 10**9 + PERIOD_NS, 612)


@pytest.mark.parametrize(('acceleration', 'sweep_duration'), [(20.0, 0.5), (50.0, 0.3)])
def test_a_servo_that_is_stronger_than_configured_is_believed(acceleration, sweep_duration):
    """The emulated motor has 200 rad/s^2, whatever is configured."""
    bench = Bench(config=ServoConfig(acceleration=acceleration))
    nod = Nod(-0.4, 0.4, sweep_duration, 4001, START_NS)
    assert len(bench.run(10.0, nod)) > 990
    assert not bench.figures.failures


def test_spikes_of_the_encoder_make_no_joint_states():
    bench = Bench()
    rng, position = np.random.default_rng(1), bench.emulator.motor._position
    bench.emulator.motor._position = lambda now_ns: (
        int(rng.integers(0, 65536)) if rng.random() < 0.05 else position(now_ns)
    )
    samples = bench.run(10.0)
    stamps = np.array([sample.stamp_ns for sample in samples])
    error = np.array([sample.pitch for sample in samples]) - bench.motion.position(stamps)
    assert len(samples) > 900
    assert np.abs(error).max() < 0.05
    assert bench.figures.failures['impossible position'] > 30
    assert not bench.following.fault
