"""The field sigma against displaced points, the error budget, and the clouds without it."""

from dataclasses import replace
import math

from bags import recording, write_bag
from hypothesis import given
from hypothesis import strategies as st
from nodlidar_assembler.bags.read_bag import read_drive
from nodlidar_assembler.bags.sensor_log import assemble_log
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE, ScanGeometry
from nodlidar_assembler.clouds.pipeline import PipelineConfig
from nodlidar_assembler.clouds.point_sigma import nod_speed, point_sigma, SigmaConfig
from nodlidar_assembler.clouds.points import place
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_common.pose import Pose
from nodlidar_planner.error_budget import budget as planned
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_planner.error_budget.swing import Swing
from nodlidar_planner.pattern.task import Task
import numpy as np
import pytest

STEP = math.tau / 1024
DRAWS = 20_000


def beams_of(count, laser_pose=REFERENCE_LASER_POSE, time_increment=0.1 / 1024):
    return Beams(ScanGeometry(count, -2.0, STEP, time_increment, 0.02, 5.6), laser_pose)


@given(st.tuples(*[st.floats(-0.3, 0.3)] * 6), st.floats(-1.0, 1.0), st.floats(-6.0, 6.0))
def test_it_is_the_jacobian_of_the_transform_for_any_mount(mount, phi, speed):
    """By central differences of the points in the range, the pitch and the time."""
    beams = beams_of(400, Pose.from_xyzrpy(mount))
    ranges, pitch = np.linspace(0.3, 5.0, 400, dtype=np.float32), np.full(400, phi)
    config = SigmaConfig(
        sigma_range=0.01, sigma_range_growth=0.003, sigma_pitch=0.004, sigma_time=0.002
    )

    def moved(by, turn):
        ends = (place(beams, ranges + s * np.float32(by), pitch + s * turn).xyz for s in (1, -1))
        return (next(ends) - next(ends)) / 2.0

    by_range = np.sum((moved(0.125, 0.0) / 0.125) ** 2, axis=0)
    by_pitch = np.sum((moved(0.0, 1e-5) / 1e-5) ** 2, axis=0)
    expected = by_range * (0.01**2 + (0.003 * ranges) ** 2)
    expected += by_pitch * (0.004**2 + (speed * 0.002) ** 2)
    xyz = place(beams, ranges, pitch).xyz
    found = point_sigma(config, ranges, xyz, np.full(400, speed))
    np.testing.assert_allclose(found, np.sqrt(expected), rtol=1e-4)


def test_it_is_the_rms_displacement_of_points_with_random_errors():
    rng = np.random.default_rng(1)
    config = SigmaConfig(sigma_pitch=0.006, sigma_time=0.002)
    beams, speed = beams_of(3), np.array([0.0, 1.7, -4.0])
    ranges, pitch = np.array([0.5, 2.0, 4.0], np.float32), np.array([-0.6, 0.1, 0.5])
    true, squares = place(beams, ranges, pitch).xyz, np.zeros(3)
    for noise, growth, turn, delay in rng.normal(size=(DRAWS, 4, 1)):
        erring = ranges + config.sigma_range * noise + config.sigma_range_growth * ranges * growth
        turned = pitch + config.sigma_pitch * turn + speed * config.sigma_time * delay
        squares += np.sum((place(beams, erring, turned).xyz - true) ** 2, axis=0)
    found = point_sigma(config, ranges, true, speed)
    np.testing.assert_allclose(found, np.sqrt(squares / DRAWS), rtol=0.03)


def test_it_is_that_of_the_error_budget_at_a_constant_speed():
    values = {'range_noise': 0.01, 'range_noise_growth': 0.005, 'encoder_error': 0.003}
    zero = dict.fromkeys(
        (
            'range_bias',
            'encoder_noise',
            'backlash',
            'deflection',
            'scan_delay_error',
            'mount_position_error',
            'mount_angle_error',
        ),
        0.0,
    )
    parameters = ErrorParameters(
        **values, **zero, joint_delay_error=0.002, encoder_step=1e-7, joint_rate=1e4
    )
    beams, ranges = beams_of(600), np.linspace(0.3, 5.0, 600, dtype=np.float32)
    pitch = np.linspace(-0.6, 0.6, 600)
    budget = planned.ErrorBudget(parameters, Swing(2.0, 10.0, 1e5))
    expected = budget.sigma(planned.Beams(ranges.astype(float), beams.azimuth, pitch))
    config = SigmaConfig(
        sigma_range=0.01, sigma_range_growth=0.005, sigma_pitch=0.003, sigma_time=0.002
    )
    found = point_sigma(config, ranges, place(beams, ranges, pitch).xyz, np.full(600, 2.0))
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_the_defaults_are_the_devices_of_the_error_budget():
    devices, config, task = ErrorParameters(), SigmaConfig(), Task()
    budget = planned.budget_of(task, task.speed(NodConfig().samples_per_sweep), devices)
    play = devices.backlash / 2.0 + devices.deflection
    pitch = math.sqrt(budget.pitch_variance + play**2 + devices.encoder_error**2)
    near = math.hypot(devices.range_noise, devices.range_bias)
    delay = math.hypot(devices.joint_delay_error, devices.scan_delay_error)
    assert config.sigma_range == pytest.approx(near, rel=0.03)
    assert config.sigma_range_growth == devices.range_noise_growth
    assert config.sigma_pitch == pytest.approx(pitch, rel=0.03)
    assert config.sigma_time == pytest.approx(delay, rel=0.03)


@given(st.integers(1, 700), st.floats(-6.0, 6.0), st.floats(-30.0, 30.0))
def test_the_speed_is_that_of_a_parabola(count, speed, acceleration):
    """Central differences are exact in the middle; at the ends they lag by half their span."""
    beams = beams_of(count)
    time = beams.offset
    found = nod_speed(beams, speed * time + acceleration / 2.0 * time**2)
    reach = (count - 1) // 8 + 1
    expected = np.full(count, speed) + acceleration * time
    if count == 1:
        assert found == [0.0]
        return
    np.testing.assert_allclose(found[reach:-reach], expected[reach:-reach], atol=1e-9)
    np.testing.assert_allclose(found, expected, atol=abs(acceleration) * time[reach] / 2 + 1e-9)


def test_beams_of_one_instant_have_no_speed():
    assert not nod_speed(beams_of(10, time_increment=0.0), np.linspace(0.0, 1.0, 10)).any()


@pytest.fixture(scope='module')
def driving(tmp_path_factory):
    bag = tmp_path_factory.mktemp('driving') / 'bag'
    write_bag(recording(1.5, velocity=(0.4, 0.5)), bag)
    return read_drive(bag, AssemblerConfig())


@pytest.mark.parametrize('cloud_mode', ['scan', 'sweep'])
@pytest.mark.parametrize('ego_motion', ['off', 'beam', 'deskew'])
def test_clouds_have_it_behind_the_other_fields_and_only_if_asked(driving, cloud_mode, ego_motion):
    log = replace(driving, odometry=None) if ego_motion == 'off' else driving
    config = PipelineConfig(cloud_mode=cloud_mode, ego_motion=ego_motion)
    without, _ = assemble_log(log, config)
    having, _ = assemble_log(log, replace(config, sigma_field=True))
    assert len(having) == len(without) > 0
    for one, other in zip(having, without, strict=True):
        names = other.data.dtype.names
        assert 'sigma' not in names
        assert one.data.dtype.names == (*names, 'sigma')
        for name in names:
            assert one.data.dtype.fields[name] == other.data.dtype.fields[name]
            np.testing.assert_array_equal(one.data[name], other.data[name])
        sigma = one.data['sigma']
        assert one.data.dtype['sigma'] == np.float32
        assert np.all((sigma > config.sigma_range) & (sigma < 0.1))


def test_the_pipeline_judges_each_point_by_its_own_range_and_place(driving):
    config = PipelineConfig(sigma_field=True, sigma_time=0.0, sigma_pitch=0.01, sigma_range=0.0)
    clouds, _ = assemble_log(replace(driving, odometry=None), config)
    for cloud in clouds:
        x, y, z = cloud.xyz.T
        squared_range = x**2 + y**2 + z**2 - 0.08**2  # the optical centre is above the pivot
        expected = 0.004**2 * squared_range + 0.01**2 * (x**2 + z**2)
        np.testing.assert_allclose(cloud.data['sigma'], np.sqrt(expected), rtol=1e-4)
