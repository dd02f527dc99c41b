from dataclasses import replace
import math

from hypothesis import given, settings, strategies
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_sim.devices.make_devices import make_devices, with_ld19
from nodlidar_sim.devices.urg_scan import Revolution
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.device_section import load_lidar
from nodlidar_sim.world.lidar import Lidar
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.nod_motion import PiecewiseMotion
from nodlidar_sim.world.raycast import PLAIN
from nodlidar_sim.world.scene import load_scene, parse_scene
from nodlidar_sim.world.section import SceneError
from nodlidar_sim.world.spot import cone, disc
from nodlidar_sim.world.world import World
import numpy as np
import pytest

S = 1_000_000_000
NOD = Nod(-0.6136, 0.6136, 4001 * 0.1 / 1024, 4001, 0)
AT = 'sensor: {mount: [0, 0, 0, 0, 0, 0], optical_offset: 0.0}\n'
BALL = AT + 'objects: {ball: {shapes: [{sphere: {center: [0, 0, 0], radius: 3}}]}}'
WALL = AT + 'objects: {wall: {shapes: [{plane: {point: [2, 0, 0], normal: [1, 0, 0]}}]}}'
# A screen at 2 m covers all to the left of straight ahead, before a wall at 3 m.
EDGE = (
    AT
    + """objects:
  wall: {shapes: [{plane: {point: [3, 0, 0], normal: [1, 0, 0]}}], brightness: 0.8}
  screen: {shapes: [{box: {pose: [2.5, 5, 0, 0, 0, 0], size: [1, 10, 20]}}], brightness: 0.4}
"""
)


def still(pitch=0.0):
    return PiecewiseMotion(np.array([0]), np.array([pitch]), np.zeros(1), np.zeros(1))


def lidar(scene, seed=0, **errors):
    return Lidar(LidarParameters(**errors), World(parse_scene(scene, 's'), still()), 0, seed)


def measured(scene, azimuth, times_ns=0, seed=0, **errors):
    azimuth = np.atleast_1d(np.asarray(azimuth, dtype=float))
    times = np.zeros(len(azimuth), dtype=np.int64) + np.asarray(times_ns, dtype=np.int64)
    return lidar(scene, seed, **errors).ranges(times, azimuth)


def segment(x):
    """Return the share of the unit disc beyond a chord at x from its centre."""
    x = np.clip(x, -1.0, 1.0)
    return (np.arccos(x) - x * np.sqrt(1.0 - x**2)) / math.pi


def test_noise_has_the_given_deviation_at_a_range():
    count = 40_000
    errors = measured(BALL, np.zeros(count), noise=0.006, noise_growth=0.004) - 3.0
    sigma = math.sqrt(0.006**2 + (0.004 * 3.0) ** 2)
    assert errors.std() == pytest.approx(sigma, rel=4.0 / math.sqrt(2.0 * count))
    assert abs(errors.mean()) < 4.0 * sigma / math.sqrt(count)
    assert abs(np.corrcoef(errors[:-1], errors[1:])[0, 1]) < 4.0 / math.sqrt(count)


def test_bias_follows_the_incidence():
    azimuth = np.linspace(-1.2, 1.2, 25)
    excess = measured(WALL, azimuth, incidence_bias=0.02) - 2.0 / np.cos(azimuth)
    np.testing.assert_allclose(excess, 0.02 * (1.0 - np.cos(azimuth)), atol=1e-9)


@pytest.mark.parametrize(('azimuth', 'brightness'), [(0.3, 0.4), (-0.3, 0.8)])
def test_bias_follows_the_brightness(azimuth, brightness):
    true = measured(EDGE, azimuth)
    excess = measured(EDGE, azimuth, brightness_bias=0.03) - true
    assert excess == pytest.approx(0.03 * (PLAIN - brightness) / PLAIN, abs=1e-9)


def test_a_wall_without_a_brightness_is_plain():
    assert measured(WALL, 0.0, brightness_bias=0.1) == pytest.approx(2.0)


def test_a_mixed_pixel_is_the_mean_by_area_brightness_and_distance():
    """The screen covers a segment of the spot; echoes fall with the square of the range."""
    azimuth = np.linspace(-0.0045, 0.0045, 19)
    found = measured(EDGE, azimuth, divergence=0.01)
    screen = segment(-azimuth / 0.005)
    near, far = screen * 0.4 / 2.0**2, (1.0 - screen) * 0.8 / 3.0**2
    expected = (2.0 * near + 3.0 * far) / (near + far)
    np.testing.assert_allclose(found, expected, atol=0.03)  # 64 rays resolve a share of 2 %
    assert np.ptp(expected) > 0.9


@settings(max_examples=60)
@given(strategies.floats(-0.02, 0.02), strategies.floats(0.001, 0.05))
def test_a_mixed_pixel_lies_between_both_surfaces(azimuth, divergence):
    found = measured(EDGE, azimuth, divergence=divergence)[0]
    rim = np.cos(abs(azimuth) + divergence / 2.0)
    assert 2.0 - 1e-9 <= found <= 3.0 / rim
    if abs(azimuth) > divergence / 2.0:
        assert found == pytest.approx((2.0 if azimuth > 0.0 else 3.0) / math.cos(azimuth))


def test_mixed_pixels_vanish_without_a_spot():
    azimuth = np.linspace(-0.0045, 0.0045, 18)
    true = np.where(azimuth > 0.0, 2.0, 3.0) / np.cos(azimuth)
    np.testing.assert_allclose(measured(EDGE, azimuth, incidence_bias=1e-12), true)
    narrow = measured(EDGE, azimuth, divergence=1e-5)
    np.testing.assert_allclose(narrow, true)


def test_spots_in_a_room_equal_a_sum_over_random_rays():
    """Independent: 4000 random rays per beam, without the test for spots on one plane."""
    scene, rng = load_scene('room').ideal(), np.random.default_rng(3)
    world = World(scene, still(-0.15))
    azimuth = np.linspace(-0.9, 0.9, 240)
    times = np.zeros(len(azimuth), dtype=np.int64)
    found = Lidar(LidarParameters(divergence=0.01), world, 0, 0).ranges(times, azimuth)
    origins, directions = world.rays(times, azimuth)
    radius, angle = np.sqrt(rng.random(4000)), rng.random(4000) * math.tau
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    apart = []
    for number, rays in enumerate(cone(directions, 0.005, points)):
        starts = np.repeat(origins[number][None], len(rays), axis=0)
        echoes = scene.surfaces.echoes(starts, rays)
        weight = echoes.brightness * echoes.cosine / echoes.ranges**2
        apart.append(found[number] - (weight * echoes.ranges).sum() / weight.sum())
    mixed = np.abs(found - world.ranges(times, azimuth)) > 0.05
    assert mixed.sum() >= 8
    assert np.abs(apart).max() < 0.08
    assert np.median(np.abs(apart)) < 1e-3


def test_a_slanted_wall_makes_no_mixed_pixels():
    azimuth = np.linspace(-1.3, 1.3, 101)
    np.testing.assert_allclose(measured(WALL, azimuth, divergence=0.01), 2.0 / np.cos(azimuth))


def test_a_disc_is_sampled_evenly():
    """A uniform disc has a mean square radius of 1/2, and 1/4 along each axis."""
    points = disc(64)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(points.T @ points / 64, np.eye(2) / 4.0, atol=0.01)


def test_beams_are_lost_on_dark_and_slanted_surfaces():
    """The echo of a wall at 2 m straight ahead is 0.8 / 4 per m2; it falls with cos^3."""
    azimuth = np.linspace(0.0, 1.4, 57)
    found = measured(WALL, azimuth, least_echo=0.02)
    np.testing.assert_array_equal(np.isnan(found), 0.2 * np.cos(azimuth) ** 3 < 0.02)
    dark = AT + (
        'objects: {wall: {shapes: [{plane: {point: [2, 0, 0], normal: [1, 0, 0]}}], '
        'brightness: 0.07}}'
    )
    assert np.isnan(measured(dark, 0.0, least_echo=0.02)).all()


def test_a_weak_echo_is_lost_at_random():
    """Of a normal distribution of deviation 0.2 about 1, a share of Phi(-1) is below 0.8."""
    count, echo = 20_000, 0.8 / 9.0
    found = measured(BALL, np.zeros(count), least_echo=0.8 * echo, echo_scatter=0.2)
    share = 0.5 * math.erfc(1.0 / math.sqrt(2.0))
    scatter = math.sqrt(share * (1.0 - share) / count)
    assert np.isnan(found).mean() == pytest.approx(share, abs=4.0 * scatter)


def test_nothing_in_view_is_not_lost():
    away = WALL.replace('[2, 0, 0]', '[-2, 0, 0]')
    assert np.isinf(measured(away, 0.0, least_echo=0.02, noise=0.01, divergence=0.01)).all()


@pytest.mark.parametrize('errors', [{}, {'divergence': 0.01}])
def test_beams_may_rise_and_all_ranges_be_too_long(errors):
    """A wall 2 m ahead, seen at azimuths and under an elevation."""
    azimuth, elevation = np.array([-0.5, 0.0, 0.9]), 0.1
    expected = 2.0 / (np.cos(azimuth) * math.cos(elevation))
    found = measured(WALL, azimuth, elevation=elevation, **errors)
    np.testing.assert_allclose(found, expected, atol=1e-3 if errors else 1e-12)
    longer = measured(WALL, azimuth, elevation=elevation, offset=0.015, **errors)
    np.testing.assert_allclose(longer - found, 0.015, atol=1e-12)


def test_it_drifts_while_it_warms_up():
    times = np.array([0, 600, 1200, 6000]) * S
    found = measured(BALL, np.zeros(4), times, warm_up_drift=0.012, warm_up_time=600.0)
    np.testing.assert_allclose(found - 3.0, 0.012 * np.exp([0.0, -1.0, -2.0, -10.0]), atol=1e-9)
    later = measured(BALL, 0.0, warm_up_drift=0.012, warm_up_time=600.0, on_for=600.0)
    assert later == pytest.approx(3.0 + 0.012 / math.e)


def test_errors_do_not_depend_on_how_beams_are_divided_into_calls():
    errors = {'noise': 0.01, 'least_echo': 0.15, 'echo_scatter': 0.3, 'divergence': 0.01}
    azimuth, times = np.linspace(-0.5, 0.5, 60), np.zeros(60, dtype=np.int64)
    at_once = lidar(EDGE, 5, **errors).ranges(times, azimuth)
    piecewise = lidar(EDGE, 5, **errors)
    pieces = [piecewise.ranges(times[i : i + 7], azimuth[i : i + 7]) for i in range(0, 60, 7)]
    np.testing.assert_allclose(np.concatenate(pieces), at_once)
    assert not np.array_equal(lidar(EDGE, 6, **errors).ranges(times, azimuth), at_once)


def test_an_ideal_lidar_measures_true_ranges():
    recording = simulate(load_scene('room', ideal=True), NOD, 0.3)
    np.testing.assert_allclose(recording.ranges, recording.true_range, atol=0.5001e-3)


def test_the_fast_mode_and_the_emulator_measure_with_the_same_errors():
    """Both on a wall that is lost: NaN, and error codes of SCIP 2.0 below 20."""
    errors = LidarParameters(least_echo=10.0)
    scene = replace(parse_scene(WALL, 'w'), lidar=errors)
    recording = simulate(scene, NOD, 0.1)
    assert not np.isfinite(recording.ranges).any()
    assert np.isnan(recording.ranges).any()
    emulator = make_devices(scene, 0, 0)['lidar']
    revolution = Revolution(0, S // 10, 0)
    revolution.measure(emulator._measure)
    assert (revolution.codes < 20).all()


@pytest.mark.parametrize('name', ['urg_04lx', 'urg_04lx_ug01'])
def test_sets_stay_within_the_data_sheet(name):
    """The stated accuracy, of a plain wall, is taken as three standard deviations."""
    limit = {'urg_04lx': 0.01, 'urg_04lx_ug01': 0.03}[name]
    ranges = np.array([0.06, 0.5, 1.0, 2.0, 4.095])
    sigma = load_lidar(name).sigma(ranges)
    assert (3.0 * sigma <= np.maximum(limit, limit * ranges)).all()


def test_an_ld19_is_as_its_data_sheet_says():
    """Deviation 10 mm to 12 m, means within 45 mm, 12 m on 70 %, beams rise by half a degree."""
    errors = load_lidar('ld19')
    np.testing.assert_allclose(errors.sigma(np.array([0.3, 12.0])), 0.010)
    assert 3.0 * errors.offset <= 0.045
    assert errors.least_echo == pytest.approx(0.7 / 12.0**2, abs=1e-4)
    assert math.degrees(errors.elevation) == pytest.approx(0.5, abs=0.01)


def test_an_ld19_has_its_own_errors_unless_the_scene_names_others():
    room = load_scene('room')
    assert with_ld19(room).lidar == load_lidar('ld19') != room.lidar
    assert with_ld19(room.ideal()).lidar.ideal
    own = replace(room, lidar=replace(load_lidar('ld19'), elevation=0.03))
    assert with_ld19(own) == own


def test_a_scene_names_a_lidar_and_what_differs():
    scene = parse_scene(WALL + '\nlidar: {model: urg_04lx_ug01, noise: 0.5}', 's')
    assert scene.lidar == replace(load_lidar('urg_04lx_ug01'), noise=0.5)
    assert scene.ideal().lidar.ideal
    assert parse_scene(WALL + '\nlidar: {model: urg_04lx}\nideal: true', 's').lidar.ideal
    assert parse_scene(WALL, 's').lidar.ideal


@pytest.mark.parametrize(
    'section', ['{model: utm_30lx}', '{noise: -1}', '{nose: 1}', '{divergence: wide}', '[]']
)
def test_nonsense_is_refused(section):
    with pytest.raises(SceneError, match='lidar'):
        parse_scene(WALL + f'\nlidar: {section}', 's')


def test_brightness_is_from_0_to_1():
    with pytest.raises(ParameterError, match='brightness'):
        parse_scene(EDGE.replace('0.4', '1.4'), 's')


@settings(max_examples=40)
@given(strategies.integers(0, 10_000))
def test_echoes_have_the_ranges_of_rays_and_the_cosine_of_the_normal(seed):
    """A sphere's normal is radial: cos = sqrt(1 - (distance of the ray from it / radius)^2)."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = rng.uniform(-1.0, 1.0, (50, 3))
    surfaces = parse_scene(BALL, 's').surfaces
    echoes = surfaces.echoes(origins, directions)
    np.testing.assert_allclose(echoes.ranges, surfaces.distances(origins, directions))
    apart = np.linalg.norm(np.cross(origins, directions), axis=1)
    np.testing.assert_allclose(echoes.cosine, np.sqrt(1.0 - (apart / 3.0) ** 2), atol=1e-3)
    room = load_scene('room').surfaces
    hits = room.echoes(origins, directions)
    np.testing.assert_allclose(hits.ranges, room.distances(origins, directions))
