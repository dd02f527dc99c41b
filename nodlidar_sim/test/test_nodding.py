"""The nod of a servo by physics in the fast mode."""

from dataclasses import replace
import math
import time

from nodlidar_common.nod import Nod
from nodlidar_sim.nodding import nodding_servo
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.device_section import load_servo, servo_names
from nodlidar_sim.world.scene import load_scene
from nodlidar_sim.world.sensor_model import SensorModel
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_800_000_000 * S
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, START_NS - 48_828)
RX24F = load_servo('rx24f')
WALL = replace(load_scene('wall', ideal=True), servo=RX24F)


def middles(pitch, times_ns):
    """Return how late [s] the servo passes the middle of each leg, by linear interpolation."""
    rises = np.flatnonzero(np.signbit(pitch[:-1]) != np.signbit(pitch[1:]))
    share = pitch[rises] / (pitch[rises] - pitch[rises + 1])
    passed_ns = times_ns[rises] + share * np.diff(times_ns)[rises]
    legs = NOD.sweeps(passed_ns.astype(np.int64))
    return (legs - np.round(legs - 0.5) - 0.5) * NOD.sweep_duration


@pytest.mark.parametrize(('rate', 'latency'), [(62.0, 0.015), (100.0, 0.002)])
def test_an_rx24f_keeps_its_phase_and_its_number_of_sweeps(rate, latency):
    sensor = SensorModel(joint_rate=rate, joint_latency=latency)
    servo = nodding_servo(RX24F, NOD, sensor, START_NS, START_NS + 30 * S, seed=2)
    times_ns = START_NS + np.arange(30_000) * (S // 1000)
    late = middles(servo.shaft_position(times_ns), times_ns)
    assert len(late) == pytest.approx(30.0 / NOD.sweep_duration, abs=1)
    assert np.sqrt(np.mean(late**2)) < 0.005
    rate = np.polyfit(np.arange(len(late)), late, 1)[0]  # s by sweep; a beam takes 98 us
    assert abs(rate) < 98e-6


def test_a_recording_has_the_truth_on_both_sides_of_the_backlash():
    linear = replace(WALL, servo=replace(RX24F, encoder_nonlinearity=0.0))
    recording = simulate(linear, NOD, 4.0, seed=1, start_ns=START_NS)
    apart = np.abs(recording.true_pitch - recording.true_encoder_pitch)
    assert 0.9 * 0.002 < np.median(apart) < 1.5 * 0.002


def test_joint_samples_are_the_encoder_s_truth_in_ticks_with_noise():
    recording = simulate(WALL, NOD, 20.0, seed=1, start_ns=START_NS)
    ticks = recording.joint_position / RX24F.tick
    np.testing.assert_allclose(ticks, np.rint(ticks), atol=1e-6)
    times_ns, truth = recording.true_time_ns, recording.true_encoder_pitch
    errors = []
    for scan_ns, pitch in zip(times_ns, truth, strict=True):  # not over the dark parts
        inside = (recording.joint_stamp_ns >= scan_ns[0]) & (
            recording.joint_stamp_ns < scan_ns[-1]
        )
        at = np.interp(recording.joint_stamp_ns[inside] - START_NS, scan_ns - START_NS, pitch)
        errors.append(recording.joint_position[inside] - at)
    error = np.concatenate(errors) / RX24F.tick
    assert error.std() == pytest.approx(math.sqrt(RX24F.encoder_noise**2 + 1.0 / 12.0), rel=0.1)
    assert abs(error.mean()) < 0.05


def test_without_backlash_both_sides_are_one_and_an_ideal_servo_has_one():
    stiff = replace(WALL, servo=replace(RX24F, backlash=0.0, encoder_nonlinearity=0.0))
    for scene in (stiff, replace(WALL, servo=None)):
        recording = simulate(scene, NOD, 1.0, start_ns=START_NS)
        np.testing.assert_array_equal(recording.true_pitch, recording.true_encoder_pitch)


def test_equal_arguments_return_equal_recordings():
    one, same, other = (simulate(WALL, NOD, 1.0, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.true_pitch, same.true_pitch)
    np.testing.assert_array_equal(one.joint_position, same.joint_position)
    assert (one.joint_position != other.joint_position).any()


@pytest.mark.parametrize('name', servo_names())
def test_every_set_nods_as_far_as_it_can(name):
    servo = nodding_servo(load_servo(name), NOD, SensorModel(), START_NS, START_NS + 5 * S)
    pitch = servo.shaft_position(START_NS + np.arange(5000) * (S // 1000))
    # The weak loop of an XL330, without integral, gives way to the weight beyond the limits.
    farthest = 0.8 if name == 'xl330' else 0.7
    assert 0.15 < pitch.max() < farthest
    assert -farthest < pitch.min() < -0.15


def test_the_fast_mode_is_much_faster_than_the_motion():
    begin = time.thread_time()
    nodding_servo(RX24F, NOD, SensorModel(), START_NS, START_NS + 10 * S)
    assert time.thread_time() - begin < 20.0 / 15.0  # usually 50 times
