import dataclasses
import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_sim.simulation import Recording, simulate
from nodlidar_sim.world.effects import Effects, imperfect, range_faults
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.nod_motion import triangle_motion
from nodlidar_sim.world.scene import load_scene, parse_scene, scene_names
from nodlidar_sim.world.sensor_model import SensorModel
import numpy as np
import pytest

S = 1_000_000_000
START_NS = 1_700_000_000 * S
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, START_NS)
TICK = math.radians(300.0) / 1024.0
ALL = Effects(0.01, 0.02, 0.001, 50.0, 0.01)


def record(scene, duration=4.0, **options):
    return simulate(scene, NOD, duration, start_ns=START_NS, **options)


def with_effects(name='room', **effects):
    return dataclasses.replace(load_scene(name, ideal=True), effects=Effects(**effects))


@pytest.fixture(scope='module')
def room():
    return record(load_scene('room', ideal=True))


def test_beams_that_rise_have_their_true_ranges():
    """A floor 1 m below; the front beams rise by 0.1 rad over the scan plane."""
    floor = 'sensor: {optical_offset: 0.0}\nobjects:\n  floor: {shapes: [{plane: '
    scene = parse_scene(floor + '{point: [0, 0, 0], normal: [0, 0, 1]}}]}', 'floor')
    scene = dataclasses.replace(scene, lidar=LidarParameters(elevation=0.1))
    seen = simulate(scene, Nod(-0.6, -0.4, 1.0, 10240, 0), 1.0)
    front = int(np.argmin(np.abs(seen.azimuth)))
    expected = 1.0 / np.sin(-(seen.true_pitch[:, front] + 0.1))
    np.testing.assert_allclose(seen.true_range[:, front], expected, rtol=1e-4)
    np.testing.assert_allclose(seen.ranges[:, front], expected, rtol=1e-3)


def test_a_scan_is_stamped_with_its_first_measured_beam(room):
    """Step 44 of revolution k is sent 44 / 1024 of 0.1 s after its start."""
    expected = START_NS + np.rint((np.arange(40) * 1024 + 44) * 97656.25).astype(np.int64)
    np.testing.assert_array_equal(room.scan_stamp_ns, expected)
    np.testing.assert_array_equal(room.true_time_ns[:, 0], expected)
    assert room.ranges.shape == room.true_range.shape == room.true_pitch.shape == (40, 682)


def test_the_scan_geometry_is_that_of_the_urg(room):
    assert room.azimuth[0] == pytest.approx(-2.08621, abs=1e-5)
    assert room.azimuth[-1] == pytest.approx(2.09235, abs=1e-5)
    assert room.sensor.angle_increment == pytest.approx(0.00613592)
    assert room.sensor.time_increment == pytest.approx(97.65625e-6)


def test_without_effects_ranges_are_the_truth_to_the_millimetre(room):
    assert np.abs(room.ranges - room.true_range).max() <= 0.0005 + 1e-9
    np.testing.assert_allclose(room.ranges * 1000.0, np.rint(room.ranges * 1000.0), atol=1e-9)


def test_the_truth_is_what_the_world_sees_at_each_beams_time(room):
    for scan in (0, 17, 39):
        times = room.true_time_ns[scan]
        np.testing.assert_array_equal(room.true_pitch[scan], room.world.motion.position(times))
        expected = room.world.ranges(times, room.azimuth)
        np.testing.assert_allclose(room.true_range[scan], expected, rtol=1e-12)


def test_joint_samples_are_ticks_at_62_hz_that_enclose_every_beam(room):
    steps = np.diff(room.joint_stamp_ns)
    np.testing.assert_allclose(steps, S / 62.0, atol=1.0)
    assert room.joint_stamp_ns[0] <= room.true_time_ns.min()
    assert room.joint_stamp_ns[-1] >= room.true_time_ns.max()
    ticks = room.joint_position / TICK
    np.testing.assert_allclose(ticks, np.rint(ticks), atol=1e-9)
    exact = triangle_motion(NOD, START_NS, START_NS + 5 * S)
    position = exact.position(room.joint_stamp_ns)
    assert np.abs(room.joint_position - position).max() <= TICK / 2.0 + 1e-12


def test_odometry_comes_at_50_hz_in_odom():
    recording = record(load_scene('corridor', ideal=True))
    np.testing.assert_array_equal(np.diff(recording.odometry_stamp_ns), S // 50)
    elapsed = (recording.odometry_stamp_ns - START_NS) / S
    np.testing.assert_allclose(recording.odometry_pose[:, 0], 0.3 * elapsed)
    np.testing.assert_array_equal(recording.odometry_pose[:, 1:], 0.0)


def test_a_driven_beam_is_cast_from_the_true_pose_of_its_instant():
    """In a figure of eight before one wall: by the circles' equations, beam by beam."""
    wall = 'objects: {w: {shapes: [{plane: {point: [3, 0, 0], normal: [1, 0, 0]}}]}}'
    eight = load_scene('wall', 'figure_of_eight', ideal=True)
    scene = dataclasses.replace(
        parse_scene(wall, 'w'), base_legs=eight.base_legs, base_repeat=eight.base_repeat
    )
    recording = record(scene, 26.0)
    seconds = (recording.true_time_ns - START_NS) / S
    lap = np.mod(seconds, 8.0 * math.pi)
    left = lap < 4.0 * math.pi
    yaw = 0.5 * np.where(left, lap, 8.0 * math.pi - lap)
    x = 0.8 * np.where(left, np.sin(yaw), -np.sin(yaw))
    phi, theta = recording.true_pitch, recording.azimuth
    ahead = np.cos(theta) * np.cos(phi) * np.cos(yaw) - np.sin(theta) * np.sin(yaw)
    centre = x - 0.08 * np.sin(phi) * np.cos(yaw)
    hits = ahead > 0.01
    expected = (3.0 - centre[hits]) / ahead[hits]
    np.testing.assert_allclose(recording.true_range[hits], expected, rtol=1e-6)
    assert np.isinf(recording.true_range[ahead < 0.0]).all()


def arrays(recording):
    return {
        f.name: getattr(recording, f.name)
        for f in dataclasses.fields(Recording)
        if isinstance(getattr(recording, f.name), np.ndarray)
    }


def test_the_same_seed_gives_the_same_recording():
    scene = dataclasses.replace(load_scene('corridor', ideal=True), effects=ALL)
    one, same = arrays(record(scene, seed=3)), arrays(record(scene, seed=3))
    for name, array in one.items():
        np.testing.assert_array_equal(array, same[name], err_msg=name)


def test_another_seed_gives_other_noise_turns_and_odometry():
    scene = dataclasses.replace(load_scene('corridor', ideal=True), effects=ALL)
    one, other = arrays(record(scene, seed=3)), arrays(record(scene, seed=4))
    differ = {name for name, array in one.items() if not np.array_equal(array, other[name])}
    assert {'ranges', 'true_pitch', 'joint_position', 'odometry_pose'} <= differ
    assert differ.isdisjoint({'scan_stamp_ns', 'azimuth', 'true_time_ns', 'true_pose'})


def test_noise_has_its_deviation_and_drop_outs_their_share():
    recording = record(with_effects(range_noise=0.02, dropouts=0.1))
    assert np.isnan(recording.ranges).mean() == pytest.approx(0.1, abs=0.01)
    errors = recording.ranges - recording.true_range
    assert np.nanstd(errors) == pytest.approx(0.02, rel=0.03)
    assert np.nanmean(errors) == pytest.approx(0.0, abs=5e-4)


def test_a_fast_lidar_clock_shortens_the_revolutions():
    recording = record(with_effects(clock_drift=500.0))
    period = (recording.scan_stamp_ns[-1] - recording.scan_stamp_ns[0]) / 39.0
    assert period == pytest.approx(0.1 * S / 1.0005, abs=1.0)


def test_servo_jitter_moves_the_nod_and_not_only_its_measurement():
    exact, jittery = (
        record(load_scene('room', ideal=True)),
        record(with_effects(servo_jitter=0.005)),
    )
    difference = jittery.true_pitch - exact.true_pitch
    assert 0.002 < difference.std() < 0.02
    measured = np.interp(jittery.true_time_ns, jittery.joint_stamp_ns, jittery.joint_position)
    assert (measured - jittery.true_pitch).std() < difference.std() / 2.0


def test_odometry_drifts_only_where_it_is_asked_for():
    exact = record(load_scene('corridor', ideal=True))
    np.testing.assert_array_equal(exact.odometry_pose, exact.true_pose)
    drifting = record(with_effects('corridor', odometry_error=0.05), seed=1)
    np.testing.assert_array_equal(drifting.true_pose, exact.true_pose)
    shares = drifting.odometry_pose[1:, 0] / exact.true_pose[1:, 0]
    assert 0.001 < np.abs(shares - 1.0).max() < 0.2


def test_an_effect_that_is_off_creates_nothing():
    def measure(times_ns, azimuth):
        raise AssertionError

    assert range_faults(Effects(), seed=0) is None
    assert imperfect(measure, Effects(servo_jitter=0.01, clock_drift=5.0), seed=0) is measure


@pytest.mark.parametrize('name', scene_names())
def test_a_scene_without_effects_draws_no_random_number(name, monkeypatch):
    """Nor makes anything that would: noise, late turns or wheels that err."""
    scene = load_scene(name, ideal=True)
    assert scene.effects == Effects()
    monkeypatch.setattr(np.random, 'default_rng', None)
    record(scene, 1.0)


@pytest.mark.parametrize('effect', [field.name for field in dataclasses.fields(Effects)])
def test_an_effect_makes_its_own_random_numbers_only(effect, monkeypatch):
    """One generator for each effect that is random, and none for the others."""
    made = []
    make = np.random.default_rng
    monkeypatch.setattr(np.random, 'default_rng', lambda seed: made.append(seed) or make(seed))
    record(with_effects(**{effect: 0.01}), 1.0)
    assert len(made) == (effect != 'clock_drift')


def test_live_measurements_have_the_same_faults():
    def measure(times_ns, azimuth):
        return np.full(len(times_ns), 2.0)

    imperfect_measure = imperfect(measure, Effects(range_noise=0.05, dropouts=0.3), seed=2)
    ranges = imperfect_measure(np.zeros(5000, dtype=int), np.zeros(5000))
    assert np.isnan(ranges).mean() == pytest.approx(0.3, abs=0.03)
    assert np.nanstd(ranges) == pytest.approx(0.05, rel=0.05)


def test_faults_are_the_same_however_beams_are_divided_into_calls():
    effects = Effects(range_noise=0.05, dropouts=0.3)
    at_once = range_faults(effects, seed=2)(np.full(100, 2.0))
    in_parts = range_faults(effects, seed=2)
    parts = [in_parts(np.full(n, 2.0)) for n in (1, 30, 69)]
    np.testing.assert_array_equal(np.concatenate(parts), at_once)


def test_too_near_and_too_far_are_distinguished():
    reported = SensorModel().rounded_ranges(
        np.array([0.0194, 0.0196, 5.6004, 5.6006, np.inf, np.nan])
    )
    np.testing.assert_array_equal(reported, [-np.inf, 0.02, 5.6, np.inf, np.inf, np.nan])


def test_another_lidar_can_be_simulated():
    sensor = SensorModel(
        steps=1440, first_step=0, last_step=1439, front_step=720, scan_time=0.05, range_max=30.0
    )
    recording = record(load_scene('room', ideal=True), 1.0, sensor=sensor)
    assert recording.ranges.shape == (20, 1440)
    assert recording.azimuth[0] == pytest.approx(-math.pi)


@pytest.mark.parametrize('duration', [0.0, 0.09, -1.0])
def test_a_recording_too_short_for_a_scan_is_refused(duration):
    with pytest.raises(ParameterError, match=r"'duration' must be at least 0\.1 s, one scan"):
        record(load_scene('wall', ideal=True), duration)


@pytest.mark.parametrize(
    ('options', 'key'),
    [
        ({'last_step': 1024}, 'last_step'),
        ({'first_step': 800}, 'last_step'),
        ({'steps': 0}, 'steps'),
    ],
)
def test_a_sensor_that_cannot_be_is_refused(options, key):
    with pytest.raises(ParameterError) as error:
        SensorModel(**options)
    assert error.value.key == key


def test_a_nod_that_is_too_quick_is_refused():
    nod = Nod(-0.6, 0.6, 0.1, 1024, 0)
    with pytest.raises(ParameterError, match='sweep_duration'):
        simulate(load_scene('wall', ideal=True), nod, 1.0)


def test_nothing_in_range_is_infinitely_far():
    far = 'objects: {w: {shapes: [{plane: {point: [6, 0, 0], normal: [1, 0, 0]}}]}}'
    recording = record(parse_scene(far, 'far'), 1.0)
    assert (recording.ranges == np.inf).all()
    assert np.isfinite(recording.true_range).any()
