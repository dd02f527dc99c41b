from nodlidar_sim.devices.controlled_joint import ControlledJoint
from nodlidar_sim.devices.trajectory_controller import Trajectory
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np
import pytest

S, MS = 1_000_000_000, 1_000_000
NOW = 1_700_000_000 * S
# At 10 rad/s^2 up to 1 rad/s in 0.1 s, at that speed for 0.6 s, and down again.
TRAPEZOID = [0.0, 0.0, np.nan], [0.05, 1.0, np.nan], [0.65, 1.0, np.nan], [0.7, 0.0, np.nan]
TIMES_NS = np.array([0, 100, 700, 800]) * MS
START_NS = NOW + 200 * MS


@pytest.fixture
def joint():
    return ControlledJoint(IdealServo(), NOW)


@pytest.fixture
def states(joint):
    states = []
    joint.publish = lambda *state: states.append(state)
    return states


def move(joint):
    joint.controller.accept(Trajectory(START_NS, TIMES_NS, np.array(TRAPEZOID)), NOW)


def truth(times):
    """Return the position at times [s] after START_NS, in closed form."""
    up, down = np.clip(times, 0.0, 0.1), np.clip(times - 0.7, 0.0, 0.1)
    return 5.0 * up**2 + np.clip(times - 0.1, 0.0, 0.6) + down - 5.0 * down**2


def test_an_ideal_joint_is_on_the_trajectory_at_every_instant(joint):
    move(joint)
    times_ns = START_NS + np.arange(0, 1000) * MS + 300_000
    expected = truth((times_ns - START_NS) / S)
    np.testing.assert_allclose(joint.position(times_ns), expected, atol=1e-9)
    assert joint.velocity(np.array([START_NS + 50 * MS])) == pytest.approx(0.5)


def test_states_are_those_of_the_lidar_at_the_instants_of_the_cycles(joint, states):
    move(joint)
    assert joint.next_event_ns() == NOW
    joint.transmit(NOW + 995 * MS)
    assert joint.next_event_ns() == NOW + 1000 * MS
    stamps, positions, velocities = map(np.array, zip(*states, strict=True))
    np.testing.assert_array_equal(stamps, NOW + np.arange(100) * 10 * MS)
    np.testing.assert_allclose(positions, truth((stamps - START_NS) / S), atol=1e-9)
    assert velocities[[20, 40, 95]] == pytest.approx([0.0, 1.0, 0.5], abs=1e-6)


def test_what_it_does_does_not_depend_on_when_it_is_asked(joint, states):
    other = ControlledJoint(IdealServo(), NOW)
    move(joint)
    move(other)
    times_ns = NOW + np.arange(1, 1000) * MS
    joint.transmit(times_ns[-1])
    one_by_one = [float(other.position(np.array([each]))[0]) for each in times_ns]
    np.testing.assert_array_equal(joint.position(times_ns), one_by_one)
    assert len(states) == 100


def test_a_trajectory_that_comes_within_a_cycle_takes_effect_with_the_next(joint):
    joint.transmit(NOW + 4 * MS)
    joint.controller.accept(
        Trajectory(0, np.array([100 * MS]), np.array([[0.5, np.nan, np.nan]])), NOW + 4 * MS
    )
    at = NOW + np.array([10, 60, 110, 500]) * MS  # a straight line from the next cycle on
    np.testing.assert_allclose(joint.position(at), [0.0, 0.25, 0.5, 0.5], atol=1e-9)


def test_a_joint_by_physics_lags_and_is_measured_in_whole_ticks():
    parameters = load_servo('rx24f')
    joint, states = ControlledJoint(PhysicalServo(parameters), NOW), []
    joint.publish = lambda *state: states.append(state)
    move(joint)
    joint.transmit(NOW + 2 * S)
    stamps, positions, _ = map(np.array, zip(*states, strict=True))
    ticks = positions / parameters.tick
    np.testing.assert_allclose(ticks, np.rint(ticks), atol=1e-6)
    at = (stamps - START_NS) / S
    middle = (at > 0.3) & (at < 0.7)
    # At 1 rad/s the motor needs 1 / 13.2 of the duty, and its friction more: 12 ms by the P gain,
    # a tick's margin, half a cycle less, and what friction takes.
    late = truth(at[middle]) - positions[middle]
    assert 0.005 < np.mean(late) < 0.03
    assert positions[-1] == pytest.approx(0.7, abs=0.02)
    assert np.ptp(positions[-50:]) <= 1.5 * parameters.tick


@pytest.mark.filterwarnings('ignore:overflow')
@pytest.mark.parametrize('shaft', [IdealServo(), PhysicalServo(load_servo('rx24f'))])
@pytest.mark.parametrize('state', [(1e308, 0.0), (0.0, 1e308), (1e6, 0.0)])
def test_what_no_hardware_reaches_is_ignored(shaft, state):
    """Splines between finite points overflow; what comes after is followed."""
    joint = ControlledJoint(shaft, NOW)
    ends = np.array([(*state, np.nan), (0.0, 0.0, np.nan)])
    joint.controller.accept(Trajectory(NOW, np.array([100, 200]) * MS, ends), NOW)
    assert np.abs(joint.position(NOW + np.arange(300) * MS)).max() < 2.0
    begin_ns = NOW + 300 * MS
    there = np.array([(0.2, 0.0, np.nan)] * 2)
    joint.controller.accept(Trajectory(begin_ns, np.array([500, 600]) * MS, there), begin_ns)
    found = joint.position(np.array([begin_ns + 900 * MS]))
    assert found == pytest.approx(0.2, abs=0.02)
