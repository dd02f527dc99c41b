"""Servos by physics behind a joint_trajectory_controller stay on the nod, in virtual time."""

from nodlidar_common.nod import Nod
from nodlidar_common.tracking import NodTracker
from nodlidar_servo.joint_trajectory.joint_sample import JointSampleFilter
from nodlidar_servo.joint_trajectory.trajectory_config import TrajectoryConfig
from nodlidar_servo.joint_trajectory.waypoints import Planner
from nodlidar_servo.ros.trajectory_message import trajectory_message
from nodlidar_sim.devices.controlled_joint import ControlledJoint
from nodlidar_sim.ros.joint_controller import trajectory_of
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np
import pytest

MS, S = 1_000_000, 1_000_000_000
START_NS = 1_763_900_000 * S
NOD = Nod(-0.6136, 0.6136, 0.74, 7547, START_NS)


@pytest.mark.parametrize('period_ms', [20, 100, 500])
@pytest.mark.parametrize('name', ['rx24f', 'xl430', 'xl330'])
def test_a_position_loop_that_lags_its_goal_is_led_into_phase(name, period_ms):
    """That of an XL430 lags by 48 ms, that of an XL330 overshoots the limits."""
    config = TrajectoryConfig()
    shaft = PhysicalServo(load_servo(name), 0.1, seed=1)
    joint = ControlledJoint(shaft, START_NS)
    samples = JointSampleFilter(config.dynamics)
    tracker = NodTracker(NOD, config.dynamics)
    planner, follows, stops = Planner(config.dynamics, config.pitch_limits), [], []

    def measured(stamp_ns, pitch, velocity):
        sample = samples.add(stamp_ns, pitch, velocity)
        tracker.measure_phase(sample)
        follows.append(planner.follows(tracker.led, sample))

    joint.publish = measured
    for now_ns in range(START_NS + 15 * MS, START_NS + 20 * S, period_ms * MS):
        joint.transmit(now_ns)
        plan = planner.plan(tracker.led, samples.latest, now_ns)
        stops.append(plan[0].time_ns > now_ns)
        message = trajectory_message('nod_joint', plan)
        joint.controller.accept(trajectory_of(message, ['nod_joint']), now_ns)
    assert all(follows[300:])
    assert stops == sorted(stops, reverse=True)  # it never stops again
    assert samples.refused == 0
    times_ns = now_ns - np.arange(int(4 * 0.74 * 1000)) * MS
    middle = np.abs(np.mod(NOD.sweeps(times_ns), 1.0) - 0.5) < 0.25
    off = shaft.shaft_position(times_ns) - NOD.pitch(times_ns)
    speed = 1.2272 / 0.74
    late = off * np.where(np.floor(NOD.sweeps(times_ns)) % 2, 1.0, -1.0) / speed
    assert abs(late[middle].mean()) < 3e-3
