"""Firmware, encoder and the history of a servo by physics."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_sim.world.device_section import load_servo, servo_names, servo_parameters
from nodlidar_sim.world.scene import parse_scene
from nodlidar_sim.world.section import Section
from nodlidar_sim.world.servo.encoder import Encoder, MOST_BLOCKS
from nodlidar_sim.world.servo.firmware import Compliance, Firmware
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np
import pytest

MS = 1_000_000
NOW = 1_800_000_000_000_000_000
TICK = 0.005
RX24F = load_servo('rx24f')


def times(first, last, step=1.0):
    """Return times [ns] from NOW + first to NOW + last, all in ms."""
    return NOW + np.rint(np.arange(first, last, step) * MS).astype(np.int64)


def duty(parameters, error, registers=None):
    firmware = Firmware(parameters)
    if registers is not None:
        firmware.set_compliance(registers)
    return firmware.step((error, 0.0, 0.0), 0.0, error, 1.0)[0]


@pytest.mark.parametrize(
    ('ticks', 'expected'),
    [(0.0, 0.0), (1.0, 0.0), (1.5, 0.1), (5.0, 0.2), (-5.0, -0.2), (15.0, 0.7), (90.0, 0.8)],
)
def test_the_duty_is_the_slope_beyond_the_margin_within_punch_and_limit(ticks, expected):
    p = ServoParameters(p_gain=0.05 / TICK, margin=1.0, punch=0.1, torque_limit=0.8, tick=TICK)
    assert duty(p, ticks * TICK) == pytest.approx(expected, abs=1e-9)


def test_registers_shape_the_loop_of_each_direction_of_a_servo_that_has_them():
    registers = Compliance(2.0, 10.0, 4.0, 20.0, 0.0, 0.9)
    p = ServoParameters(tick=TICK, compliance=True)
    assert duty(p, 7.0 * TICK, registers) == pytest.approx(0.5)
    assert duty(p, -14.0 * TICK, registers) == pytest.approx(-0.5)
    assert duty(p, 100.0 * TICK, registers) == 0.9
    other = ServoParameters(tick=TICK, p_gain=3.0)
    assert duty(other, 7.0 * TICK, registers) == pytest.approx(21.0 * TICK)
    assert duty(other, 1000.0 * TICK, registers) == 0.9


def test_the_reference_moves_at_the_speed_and_the_integral_and_change_add_up():
    p = ServoParameters(p_gain=2.0, i_gain=30.0, d_gain=0.01)
    firmware, loop = Firmware(p), (0.0, 0.0, 0.0)
    value, loop = firmware.step(loop, 0.0, 1.0, 4.0)
    assert loop[0] == pytest.approx(0.004)
    assert value == pytest.approx(2.0 * 0.004 + 30.0 * 0.004e-3 + 0.01 * 0.004 / 1e-3)
    value, loop = firmware.step(loop, 0.0, 1.0, 4.0)
    assert loop[0] == pytest.approx(0.008)
    assert value == pytest.approx(2.0 * 0.008 + 30.0 * 0.012e-3 + 0.01 * 0.004 / 1e-3)


@pytest.mark.parametrize('speed', [1.0, -3.0])
def test_a_shaft_follows_a_ramp_with_the_lag_of_its_gain(speed):
    p = ServoParameters(
        kt=0.9, supply=12.0, p_gain=6.0, tick=1e-6, load_mass=0.0, load_inertia=0.0
    )
    servo = PhysicalServo(p)
    servo.set_goal(NOW, math.copysign(9.0, speed), abs(speed))
    late = times(1500, 1600)
    lag = speed * (late - NOW) / 1e9 - servo.position(late)
    np.testing.assert_allclose(lag, speed * 0.9 / 12.0 / 6.0, rtol=1e-2, atol=2e-3 * abs(speed))
    np.testing.assert_allclose(servo.velocity(late), speed, rtol=1e-2)


def test_a_servo_holds_its_goal_against_the_weight_with_the_error_of_its_gain():
    p = ServoParameters(p_gain=6.0, tick=1e-6, load_mass=0.5, load_height=0.2)
    servo = PhysicalServo(p)
    servo.set_goal(NOW, 0.5, 1.0)
    held = float(servo.position(times(3000, 3001))[0])
    torque = 0.5 * 9.81 * 0.2 * math.sin(held)
    assert held - 0.5 == pytest.approx(torque / p.standstill_torque / 6.0, rel=1e-3)
    assert servo.load(NOW + 3000 * MS) == pytest.approx(-torque / p.standstill_torque, rel=1e-3)


def test_it_rests_until_the_first_command_and_falls_when_the_torque_is_off():
    p = ServoParameters(load_mass=0.5)
    servo = PhysicalServo(p, 0.4)
    assert set(servo.position(times(-10_000, 10_000, 999.0))) == {0.4}
    servo.brake(NOW)
    assert set(servo.position(times(-10_000, 0, 999.0))) == {0.4}
    assert servo.position(times(100, 101))[0] > 0.41


def test_it_coasts_to_rest_without_torque_and_time_at_rest_is_skipped():
    servo = PhysicalServo(RX24F, 0.2)
    servo.set_goal(NOW, 0.5, 3.0)
    servo.brake(NOW + 100 * MS)
    stopped = servo.position(times(2_000, 2_001))
    much_later = NOW + 86_400_000 * MS
    np.testing.assert_array_equal(servo.position(np.array([much_later])), stopped)
    servo.set_goal(much_later, 0.0, 3.0)
    assert abs(servo.position(np.array([much_later + 1000 * MS]))[0]) < 0.02


def test_after_time_that_was_skipped_the_history_is_as_long_as_ever():
    servo = PhysicalServo(RX24F, 0.2, history=2.0)
    servo.set_goal(NOW, 0.5, 3.0)
    servo.brake(NOW + 1000 * MS)
    later = NOW + 60_000 * MS + np.arange(-2000, 0) * MS
    assert len(set(servo.position(later))) == 1
    with pytest.raises(ParameterError, match='the start of the history'):
        servo.position(later[:1] - 10 * MS)


def test_skipped_time_that_is_shorter_than_the_history_leaves_it_whole():
    servo = PhysicalServo(RX24F, 0.2, history=12.0)
    servo.set_goal(NOW, 0.5, 3.0)
    servo.brake(NOW + 1000 * MS)
    late = NOW + 13_050 * MS
    servo.position(np.array([late]))
    begin = servo.position(np.array([late - 11_990 * MS]))[0]  # shortly after the brake
    other = PhysicalServo(RX24F, 0.2, history=12.0)
    other.set_goal(NOW, 0.5, 3.0)
    other.brake(NOW + 1000 * MS)
    assert begin == other.position(np.array([late - 11_990 * MS]))[0]


@pytest.mark.parametrize('name', ['rx24f', 'xl330'])
def test_a_lidar_without_torque_falls_also_if_nobody_looks(name):
    """Friction holds the shaft only as long as the motor does."""
    pitches = []
    for seconds in ([14], range(4, 15)):
        servo = PhysicalServo(load_servo(name), 0.9)
        servo.set_goal(NOW, 1.0, 2.0)
        servo.brake(NOW + 3000 * MS)
        pitches.append([servo.position(np.array([NOW + s * 1000 * MS]))[0] for s in seconds][-1])
    assert pitches[0] == pytest.approx(pitches[1], abs=1e-9)
    assert pitches[0] > 1.29  # the stop


@pytest.mark.parametrize('torque', [True, False])
def test_a_servo_that_is_only_read_keeps_no_more_than_twice_its_history(torque):
    servo = PhysicalServo(RX24F, 0.2, history=1.0)
    servo.set_goal(NOW, 0.5, 3.0)
    if not torque:
        servo.brake(NOW + 1000 * MS)
    for tenth in range(1, 200):
        servo.measured(NOW + tenth * 100 * MS)
        servo.position(NOW + (tenth * 100 - np.arange(60, 0, -5)) * MS)
    assert len(servo._states) <= 2000 + 101


@settings(max_examples=30)
@given(
    st.lists(
        st.tuples(st.floats(0.1, 80.0), st.floats(-0.6, 0.6), st.floats(0.1, 8.0)),
        min_size=1,
        max_size=6,
    ),
    st.lists(st.floats(0.0, 600.0), max_size=6),
)
def test_the_motion_does_not_depend_on_when_it_is_asked(commands, asked):
    asked_servo, other = PhysicalServo(RX24F, seed=3), PhysicalServo(RX24F, seed=3)
    now = NOW
    for wait, goal, speed in commands:
        now += round(wait * MS)
        for ahead in asked:
            asked_servo.encoder(np.array([now + round(ahead * MS)]))
        for servo in (asked_servo, other):
            servo.set_goal(now, goal, speed)
    at = now + np.arange(-50, 300) * MS // 2
    np.testing.assert_array_equal(asked_servo.position(at), other.position(at))
    np.testing.assert_array_equal(asked_servo.encoder(at), other.encoder(at))


def test_one_measurement_is_as_many():
    servo = PhysicalServo(RX24F, 0.1)
    before = times(-3, 3, 0.7)
    pitch, speed = np.array([servo.measured(int(each)) for each in before]).T
    np.testing.assert_array_equal(pitch, servo.encoder(before))
    assert not speed.any()
    servo.set_goal(NOW, 0.5, 3.0)
    at = times(-3, 40, 0.7)
    pitch, speed = np.array([servo.measured(int(each)) for each in at]).T
    np.testing.assert_allclose(pitch, servo.encoder(at), atol=1e-12)
    np.testing.assert_allclose(speed, servo.shaft_velocity(at), atol=1e-12)


def test_equal_seeds_give_equal_motions_and_others_differ():
    def moved(seed):
        servo = PhysicalServo(RX24F, seed=seed)
        servo.set_goal(NOW, 0.5, 3.0)
        return servo.position(times(0, 300))

    np.testing.assert_array_equal(moved(1), moved(1))
    assert (moved(1) != moved(2)).any()


@pytest.mark.parametrize('name', servo_names())
def test_position_and_velocity_are_continuous_and_fit_together(name):
    servo = PhysicalServo(load_servo(name))
    servo.set_goal(NOW, 0.5, 3.0)
    fine = times(0, 300, 0.01)
    position, velocity = servo.position(fine), servo.velocity(fine)
    fastest = np.abs(velocity).max()
    assert np.abs(np.diff(position)).max() <= 1.1 * fastest * 1e-5
    assert np.abs(np.diff(velocity)).max() < 0.02 * fastest
    slope = np.diff(position) / 1e-5
    np.testing.assert_allclose(slope, (velocity[1:] + velocity[:-1]) / 2.0, atol=1e-2 * fastest)


def test_history_is_kept_as_long_as_asked():
    servo = PhysicalServo(RX24F, history=0.5)
    for ms in range(0, 4000, 10):
        servo.set_goal(NOW + ms * MS, 0.3, 1.0)
        servo.position(times(max(0, ms - 450), ms))
    with pytest.raises(ParameterError, match='times_ns'):
        servo.position(times(1000, 1001))


@pytest.mark.parametrize(('goal', 'speed'), [(math.nan, 1.0), (0.1, 0.0), (0.1, -1.0)])
def test_commands_that_make_no_sense_are_refused(goal, speed):
    with pytest.raises(ParameterError):
        PhysicalServo(RX24F).set_goal(NOW, goal, speed)


def test_an_encoder_keeps_little_of_a_long_run_and_reads_the_same_again():
    encoder = Encoder(ServoParameters(tick=TICK, encoder_noise=3.0), 1)
    periods = np.arange(0, 1_000_000, 999)
    first = encoder.readings(np.zeros(len(periods)), periods)
    assert len(encoder._blocks) == MOST_BLOCKS
    np.testing.assert_array_equal(encoder.readings(np.zeros(len(periods)), periods), first)


def test_an_encoder_without_errors_rounds_to_its_ticks():
    shaft = np.linspace(-0.7, 0.7, 5001)
    read = Encoder(ServoParameters(tick=TICK), 1).readings(shaft, np.arange(5001))
    np.testing.assert_allclose(read / TICK, np.rint(read / TICK), atol=1e-9)
    assert np.abs(read - shaft).max() <= TICK / 2.0 + 1e-12


def test_the_nonlinearity_is_smooth_and_within_its_bound():
    p = ServoParameters(tick=1e-5, encoder_nonlinearity=100.0)
    shaft = np.linspace(-math.pi, math.pi, 2001)
    encoder = Encoder(p, 4)
    error = encoder.readings(shaft, np.zeros(2001, dtype=np.int64)) - shaft
    assert np.abs(encoder.smooth(shaft) - shaft - error).max() <= 0.5001e-5
    assert 3e-4 < np.abs(error).max() <= 1e-3 + 1e-5
    assert error[0] == pytest.approx(error[-1], abs=2e-5)  # a turn
    assert np.abs(np.diff(error)).max() < 1e-3 * 2.0 * math.pi * 1.5 / 2000 + 2e-5


def test_the_noise_has_its_deviation():
    p = ServoParameters(tick=1e-4, encoder_noise=3.0)
    read = Encoder(p, 4).readings(np.zeros(20_000), np.arange(20_000) + 1_800_000_000_000)
    assert read.std() / 1e-4 == pytest.approx(math.sqrt(9.0 + 1.0 / 12.0), rel=0.03)
    assert abs(np.corrcoef(read[1:], read[:-1])[0, 1]) < 0.03


def test_a_motor_under_load_warms_up_to_what_its_loss_keeps():
    p = ServoParameters(
        p_gain=1e6, tick=1e-6, warming=5.0, warming_time=1.0, friction_coulomb=20.0,
        torque_limit=0.5,
    )  # fmt: skip
    servo = PhysicalServo(p)
    servo.set_goal(NOW, 1.0, 10.0)
    cold, warm = servo.load(NOW + 2 * MS), servo.load(NOW + 20_000 * MS)
    volts, copper = 6.0, 0.0039  # warmth = 5 K/W * V^2 / (R (1 + copper * warmth))
    warmth = (math.sqrt(1.0 + 4.0 * copper * 5.0 * volts**2 / 5.0) - 1.0) / (2.0 * copper)
    assert cold == pytest.approx(0.5, rel=1e-3)
    assert warm == pytest.approx(0.5 / (1.0 + copper * warmth), rel=1e-3)


def test_a_scene_overrides_a_set_and_may_bring_its_own(tmp_path):
    own = tmp_path / 'own.yaml'
    own.write_text('kt: 2.0\nsupply: 24.0\nsubsteps: 4\ncompliance: true\n')

    def parsed(**servo):
        return servo_parameters(Section({'servo': servo}, 'scene.yaml'))

    assert servo_parameters(Section({}, 'scene.yaml')) is None
    assert parsed(model='rx24f') == RX24F
    assert parsed(model='rx24f', backlash=0.0).backlash == 0.0
    assert parsed(model=str(own), supply=20.0) == ServoParameters(
        kt=2.0, supply=20.0, substeps=4, compliance=True
    )


@pytest.mark.parametrize(
    ('servo', 'named'),
    [
        ({'model': 'rx25'}, 'servo.model'),
        ({'model': 3}, 'servo.model'),
        ({'model': 'rx24f', 'kt': 0.0}, 'servo.kt'),
        ({'model': 'rx24f', 'kt': 'strong'}, 'servo.kt'),
        ({'model': 'rx24f', 'colour': 1.0}, 'servo.colour'),
        ({'model': 'rx24f', 'substeps': 1.5}, 'servo.substeps'),
        ({'compliance': 1}, 'servo.compliance'),
        ([], 'servo'),
    ],
)
def test_a_scene_with_a_senseless_servo_is_refused(servo, named):
    with pytest.raises(ParameterError, match=named.replace('.', r'\.')):
        servo_parameters(Section({'servo': servo}, 'scene.yaml'))


def test_jitter_of_the_ideal_servo_is_refused_beside_a_servo():
    text = 'servo: {model: rx24f}\neffects: {servo_jitter: 0.001}\nobjects: {}\n'
    with pytest.raises(ParameterError, match=r'effects\.servo_jitter'):
        parse_scene(text, 'scene')
    assert parse_scene(text.replace('0.001', '0.0'), 'scene').servo == RX24F


@settings(max_examples=60)
@given(
    kt=st.floats(0.2, 3.0),
    resistance=st.floats(1.0, 40.0),
    armature=st.floats(1e-3, 0.03),
    friction_load=st.floats(0.0, 0.4),
    stribeck_load=st.floats(0.0, 0.4),
    friction_coulomb=st.floats(0.0, 0.2),
    p_gain=st.floats(0.5, 12.0),
    d_gain=st.floats(0.0, 0.02),
    backlash=st.floats(0.0, 0.02),
    load_mass=st.floats(0.05, 0.5),
    supply_resistance=st.floats(0.0, 2.0),
    goals=st.lists(st.floats(-0.8, 0.8), min_size=2, max_size=5),
)
def test_any_servo_stays_within_the_speed_that_its_torques_can_reach(goals, **values):
    p = ServoParameters(**values, load_inertia=1e-3, punch=0.03, margin=1.0, stiffness=100.0)
    servo = PhysicalServo(p, history=10.0)
    for number, goal in enumerate(goals):
        servo.set_goal(NOW + 200 * number * MS, goal, 20.0)
    speed = servo.shaft_velocity(times(0, 200 * len(goals)))
    weight = p.load_mass * 9.81 * p.load_height
    energy = p.no_load_speed**2 + 4.0 * weight / (p.armature + p.lidar_inertia)
    assert np.abs(speed).max() <= 1.3 * math.sqrt(energy)
    assert np.abs(servo.position(times(0, 200 * len(goals)))).max() < 3.2 * len(goals)
