"""The plant against closed forms, derived here from the parameters alone."""

import math

from hypothesis import given
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_sim.world.device_section import load_servo, servo_names
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo.plant import Plant
import numpy as np
import pytest

KT, OHM, VOLT, ARMATURE = 0.9, 4.0, 12.0, 0.005
BARE = {'kt': KT, 'resistance': OHM, 'supply': VOLT, 'armature': ARMATURE, 'load_mass': 0.0}
MOTOR = {**BARE, 'load_inertia': 0.0}
PENDULUM = {**BARE, 'load_mass': 0.5, 'load_height': -0.2, 'load_inertia': 0.001}
AT_REST = (0.0, 0.0, 0.0, 0.0)
FRICTIONS = ('friction_viscous', 'friction_coulomb', 'friction_load', 'stribeck_coulomb')


def run(parameters, duration, duty=None, motion=AT_REST, warmth=0.0):
    """Return the motions at the starts of all periods, shape (n, 4)."""
    plant, motions = Plant(parameters), [motion]
    for _ in range(round(duration * 1000)):
        motions.append(plant.advance(motions[-1], duty, warmth))
    return np.array(motions)


def rest_at(pitch):
    return pitch, 0.0, pitch, 0.0


@pytest.mark.parametrize('duty', [1.0, 0.4, -0.7])
def test_without_load_the_motor_reaches_its_speed_as_an_exponential(duty):
    speed = run(ServoParameters(**MOTOR, substeps=20), 0.5, duty)[:, 1]
    time = np.arange(len(speed)) / 1000.0
    rate = KT**2 / OHM / ARMATURE
    expected = duty * VOLT / KT * (1.0 - np.exp(-rate * time))
    np.testing.assert_allclose(speed, expected, atol=1e-3 * abs(duty) * VOLT / KT)


@pytest.mark.parametrize('share', [0.99, 1.01])
def test_at_standstill_the_motor_lifts_what_its_torque_can(share):
    torque = KT * VOLT / OHM
    mass = share * torque / (9.81 * 0.2)  # held level, at a right angle to its weight
    p = ServoParameters(**{**MOTOR, 'load_mass': mass, 'load_height': 0.2})
    start = rest_at(-math.pi / 2)
    assert (run(p, 0.02, 1.0, start)[-1, 0] > start[0]) == (share < 1.0)


@pytest.mark.parametrize('resistance', [0.0, 0.5, 2.0])
def test_a_supply_sags_by_its_resistance(resistance):
    p = ServoParameters(**MOTOR, supply_resistance=resistance)
    torque, _ = Plant(p).drive(1.0, 0.0, OHM)
    assert torque == pytest.approx(KT * VOLT / (OHM + resistance))
    half, _ = Plant(p).drive(0.5, 0.0, OHM)  # the supply carries half of the motor's current
    volts = VOLT - resistance * 0.5 * (half / KT)
    assert half == pytest.approx(KT * 0.5 * volts / OHM)
    free = run(p, 3.0, 1.0)[-1, 1]
    assert free == pytest.approx(VOLT / KT, rel=1e-3)  # without load no current flows


def test_a_warm_motor_has_the_resistance_of_warm_copper():
    p = ServoParameters(**MOTOR)
    cold, warm = (run(p, 0.001, 1.0, warmth=warmth)[1, 1] for warmth in (0.0, 100.0))
    assert warm / cold == pytest.approx(1.0 / 1.39, rel=0.02)


def agm(a, b):
    for _ in range(30):
        a, b = (a + b) / 2.0, math.sqrt(a * b)
    return a


@pytest.mark.parametrize('amplitude', [0.05, 1.0, 2.5])
def test_a_pendulum_swings_with_its_period_and_keeps_its_energy(amplitude):
    p = ServoParameters(**PENDULUM, substeps=10)
    inertia = ARMATURE + 0.5 * 0.2**2 + 0.001
    weight = 0.5 * 9.81 * 0.2
    small = 2.0 * math.pi * math.sqrt(inertia / weight)
    period = small / agm(1.0, math.cos(amplitude / 2.0))
    motions = run(p, 5.2 * period, motion=rest_at(amplitude))
    pitch, speed = motions[:, 0], motions[:, 1]
    falling = np.flatnonzero((pitch[:-1] > 0.0) & (pitch[1:] <= 0.0))
    crossings = falling + pitch[falling] / (pitch[falling] - pitch[falling + 1])
    np.testing.assert_allclose(np.diff(crossings) / 1000.0, period, rtol=1e-3)
    energy = 0.5 * inertia * speed**2 + weight * (1.0 - np.cos(pitch))
    np.testing.assert_allclose(energy, energy[0], atol=0.01 * energy[0])


@given(st.floats(-1.5, 1.5), st.floats(0.001, 1.0), st.floats(0.0, 0.4), st.floats(0.0, 1.0))
def test_friction_holds_up_to_its_torque_and_no_further(pitch, coulomb, load, stribeck):
    p = ServoParameters(
        **PENDULUM, friction_coulomb=coulomb, stribeck_coulomb=stribeck, friction_load=load
    )
    torque = abs(0.5 * 9.81 * 0.2 * math.sin(pitch))
    most = coulomb + stribeck + load * torque
    moved = run(p, 0.003, motion=rest_at(pitch))[-1, 0] != pitch
    if abs(torque - most) > 1e-9:
        assert moved == (torque > most)


@given(st.floats(-10.0, 10.0), st.floats(0.0, 1.0), st.floats(0.0, 0.1), st.floats(0.0, 1.0))
def test_friction_slows_and_never_drives(speed, coulomb, viscous, stribeck):
    p = ServoParameters(
        **MOTOR, friction_coulomb=coulomb, friction_viscous=viscous, stribeck_coulomb=stribeck
    )
    speeds = run(p, 0.05, motion=(0.0, speed, 0.0, speed))[:, 1]
    assert (np.diff(np.abs(speeds)) <= 1e-14).all()
    assert (speeds * speed >= 0.0).all()


def test_constant_friction_stops_a_shaft_in_its_time():
    p = ServoParameters(**MOTOR, friction_coulomb=0.1, substeps=10)
    speeds = run(p, 0.3, motion=(0.0, 5.0, 0.0, 5.0))[:, 1]
    assert np.argmax(speeds == 0.0) / 1000.0 == pytest.approx(ARMATURE * 5.0 / 0.1, abs=0.0011)


@pytest.mark.parametrize('duty', [0.2, 1.0])
def test_the_speed_under_friction_is_where_torques_balance(duty):
    viscous, coulomb, share, static, ws, exponent = 0.02, 0.05, 0.1, 0.2, 0.7, 1.4
    p = ServoParameters(
        **MOTOR, friction_viscous=viscous, friction_coulomb=coulomb, friction_load=share,
        stribeck_coulomb=static, stribeck_speed=ws, stribeck_exponent=exponent,
    )  # fmt: skip
    w = run(p, 3.0, duty)[-1, 1]
    motor = KT * (duty * VOLT - KT * w) / OHM
    friction = viscous * w + coulomb + share * motor + math.exp(-((w / ws) ** exponent)) * static
    assert w > 0.5
    assert motor == pytest.approx(friction, abs=1e-9)


def test_without_torque_the_motor_does_not_brake_and_at_duty_0_it_does():
    p = ServoParameters(**MOTOR)
    turning = (0.0, 5.0, 0.0, 5.0)
    assert run(p, 0.1, None, turning)[-1, 1] == 5.0
    rate = KT**2 / OHM / ARMATURE
    braked = run(p, 0.1, 0.0, turning)[-1, 1]
    assert braked == pytest.approx(5.0 * math.exp(-rate * 0.1), rel=0.05)


def test_a_cable_pulls_to_where_it_rests():
    p = ServoParameters(
        **MOTOR, cable_stiffness=0.2, cable_rest=0.3, friction_viscous=0.05, substeps=4
    )
    assert run(p, 5.0)[-1, 0] == pytest.approx(0.3, abs=1e-3)


def test_a_bracket_stops_the_shaft():
    p = ServoParameters(**PENDULUM, stop=0.4)
    motions = run(p, 3.0, motion=(0.0, 3.0, 0.0, 3.0))
    at_stop = np.flatnonzero(motions[:, 0] == 0.4)
    assert motions[:, 0].max() == 0.4
    assert motions[at_stop[0], 1] == 0.0  # without bouncing
    assert motions[:, 0].min() >= -0.4


@pytest.mark.parametrize('side', [1.0, -1.0])
def test_a_lidar_with_backlash_leans_to_the_side_of_its_weight(side):
    p = ServoParameters(**BARE | {'load_mass': 0.3}, backlash=0.006, friction_coulomb=1.0)
    pitch = side * 0.4
    lidar = run(p, 2.0, motion=rest_at(pitch))[-1, 2]
    torque = 0.3 * 9.81 * 0.08 * math.sin(lidar)
    assert lidar - pitch == pytest.approx(side * 0.003 + torque / p.stiffness, abs=1e-6)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=8))
def test_a_lidar_keeps_within_its_backlash_and_the_spring(duties):
    p = ServoParameters(**BARE | {'load_mass': 0.16}, backlash=0.004)
    motion, plant, most = AT_REST, Plant(p), 0.0
    for duty in np.repeat(duties, 30):
        motion = plant.advance(motion, float(duty), 0.0)
        most = max(most, abs(motion[0] - motion[2]))
    # An impact of the whole speed that the shaft can have, on the spring alone.
    impact = 2.0 * p.no_load_speed / p.contact_frequency
    assert most <= 0.002 + impact + 2.0 * p.standstill_torque / p.stiffness


def test_with_backlash_momentum_only_changes_by_the_torques():
    p = ServoParameters(**BARE, load_inertia=1e-3, backlash=0.004)
    motions = run(p, 0.2, motion=(0.0, 2.0, 0.0, 0.0))
    momentum = p.armature * motions[:, 1] + p.lidar_inertia * motions[:, 3]
    np.testing.assert_allclose(momentum, p.armature * 2.0, rtol=1e-9)
    assert motions[-1, 1] == pytest.approx(motions[-1, 3], abs=0.2)  # they end up together


@pytest.mark.parametrize('backlash', [0.0, 0.004])
@pytest.mark.parametrize('name', servo_names())
def test_the_error_is_in_proportion_to_the_step(name, backlash):
    p = load_servo(name)

    def swing(substeps):
        values = {key: getattr(p, key) for key in p.__dataclass_fields__}
        fine = ServoParameters(**{**values, 'substeps': substeps, 'backlash': backlash})
        motion, plant, pitch = rest_at(0.1), Plant(fine), []
        for duty in np.repeat([0.5, -0.5, 0.3], 100):
            motion = plant.advance(motion, float(duty), 0.0)
            pitch.append(motion[2])
        return np.array(pitch)

    exact = swing(100)
    coarse, fine = (float(np.sqrt(np.mean((swing(n) - exact) ** 2))) for n in (2, 8))
    assert fine < 0.4 * coarse  # a quarter, but for the instants at which friction holds
    assert coarse < 2e-3


@pytest.mark.parametrize(
    ('name', 'rpm', 'torque'),
    [
        ('rx24f', 126.0, 2.6),
        ('rx28', 85.0, 3.7),
        ('rx64', 64.0, 5.3),
        ('ax12a', 59.0, 1.5),
        ('ax18a', 97.0, 1.8),
        ('mx28', 55.0, 2.5),
        ('xl430', 61.0, 1.5),
        ('xl330_m077', 383.0, 0.215),
    ],
)
def test_a_set_has_the_speed_and_the_torque_of_its_data_sheet(name, rpm, torque):
    p = load_servo(name)
    assert p.no_load_speed * 60.0 / math.tau == pytest.approx(rpm, rel=2e-3)
    assert p.standstill_torque == pytest.approx(torque, rel=2e-3)


@pytest.mark.parametrize('key', ['kt', 'resistance', 'armature', *FRICTIONS, 'tick', 'backlash'])
@pytest.mark.parametrize('value', [-1.0, math.nan, math.inf])
def test_nonsense_is_refused(key, value):
    with pytest.raises(ParameterError, match=key):
        ServoParameters(**{key: value})


def test_a_contact_too_stiff_for_the_step_is_refused():
    with pytest.raises(ParameterError, match='stiffness'):
        ServoParameters(backlash=0.004, stiffness=5000.0)
    ServoParameters(backlash=0.004, stiffness=5000.0, substeps=8)
    ServoParameters(stiffness=5000.0)
