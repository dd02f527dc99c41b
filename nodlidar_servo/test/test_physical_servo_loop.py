"""The servo's loop keeps its phase on a servo by physics, in virtual time."""

from dataclasses import replace

from nodlidar_servo.device.config import ServoConfig
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np
import pytest
from test_servo_loop import Bench, NOD, START_NS, SWEEP

BEAM_PERIOD = 0.1 / 1024
SETTLING, DURATION = 8.0, 30.0


def lateness(bench):
    """Return how late [s] the shaft is in the middle of each leg, after SETTLING."""
    times = np.arange(START_NS + round(SETTLING * 1e9), bench.clock(), 1_000_000)
    pitch = bench.motion.shaft_position(times)
    before = np.flatnonzero(np.signbit(pitch[:-1]) != np.signbit(pitch[1:]))
    share = pitch[before] / (pitch[before] - pitch[before + 1])
    sweeps = NOD.sweeps(times[before] + np.rint(share * 1e6).astype(np.int64))
    first = round(float(sweeps[0]) - 0.5)
    return (sweeps - 0.5 - first - np.arange(len(sweeps))) * SWEEP


@pytest.mark.parametrize(
    ('name', 'latency_timer', 'model'),
    [
        ('rx24f', 0.016, 'RX-24F'),
        ('mx28', 0.016, 'RX-24F'),
        ('xl430', 0.001, 'XL430-W250'),
    ],
)
def test_the_phase_of_a_servo_that_can_is_locked(name, latency_timer, model):
    motion = PhysicalServo(load_servo(name), 0.2, seed=3, history=1e6)
    bench = Bench(latency_timer, motion=motion, config=ServoConfig(model=model))
    bench.run(SETTLING + DURATION)
    late = lateness(bench)
    duration = (bench.clock() - START_NS) / 1e9 - SETTLING
    assert len(late) == pytest.approx(duration / SWEEP, abs=1)
    beams_by_sweep = np.polyfit(np.arange(len(late)), late, 1)[0] / BEAM_PERIOD
    assert abs(beams_by_sweep) < 1.0  # N_s
    assert np.sqrt(np.mean(late**2)) < 0.006
    assert not bench.following.fault


@pytest.mark.parametrize('gain', [0.75, 0.5, 0.4])
def test_the_phase_of_a_servo_is_locked_whatever_the_scale_of_its_gain(gain):
    """The e-manual may state the gains of an XL430 at twice their scale, as of an XL330."""
    servo = load_servo('xl430')
    motion = PhysicalServo(replace(servo, p_gain=gain * servo.p_gain), 0.2, seed=3, history=1e6)
    bench = Bench(0.001, motion=motion, config=ServoConfig(model='XL430-W250'))
    bench.run(SETTLING + 15.0)
    late = lateness(bench)
    assert np.sqrt(np.mean(late**2)) < 0.006
    assert bench.loop.progress.lead_ns > 20_000_000
    assert not bench.following.fault


def test_a_servo_that_cannot_keep_up_is_not_locked_but_nods_on():
    bench = Bench(0.001, motion=PhysicalServo(load_servo('xl320'), 0.2, history=1e6))
    bench.run(10.0)
    pitch = bench.motion.shaft_position(bench.clock() - np.arange(2000) * 1_000_000)
    assert np.ptp(pitch) > 0.2
    assert bench.loop.progress.lead_ns == 0
