"""The command map_bag: its files, read by other programs' formats, and its errors."""

from dataclasses import replace
import re
from types import SimpleNamespace

from matplotlib.image import imread
from nodlidar_common.nod import Nod
from nodlidar_mapper.commands.entry_points import map_bag
from nodlidar_mapper.geometry.poses import inverse, planar
from nodlidar_mapper.offline import silence_between
from nodlidar_sim.bag import write_bag
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.route import Leg
from nodlidar_sim.world.scene import load_scene
import numpy as np
from plyfile import PlyData
import pytest
import yaml

START_NS = 10**18
NOD = Nod(-0.6136, 0.6136, 7547 / 10240, 7547, START_NS)


@pytest.fixture(scope='module')
def recording():
    return simulate(load_scene('room', 'turn'), NOD, 9.0, 1, start_ns=START_NS)


@pytest.fixture(scope='module')
def output(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp('mapped')
    write_bag(recording, folder / 'bag')
    assert map_bag([str(folder / 'bag'), str(folder / 'out')]) == 0
    return folder / 'out'


def test_the_picture_of_the_grid_is_as_its_yaml_file_says(output):
    said = yaml.safe_load((output / 'map.yaml').read_text())
    assert set(said) >= {'image', 'resolution', 'origin', 'negate', 'occupied_thresh'}
    grey = imread(output / said['image'])
    assert set(np.unique(grey)) == {0, 205, 254}
    height, width = grey.shape
    x, y, _ = said['origin']
    column, row = int(-x / said['resolution']), height - 1 - int(-y / said['resolution'])
    assert grey[row, column] == 254  # where the robot stands
    assert 6.0 < width * said['resolution'] < 9.5  # the room is 6.4 m long


@pytest.mark.parametrize(('grey', 'kind'), [(0, 'occupied'), (205, 'unknown'), (254, 'free')])
def test_map_server_reads_each_shade_as_it_was_meant(output, grey, kind):
    said = yaml.safe_load((output / 'map.yaml').read_text())
    occupancy = (255 - grey) / 255.0  # map_server's trinary mode, negate 0
    free, occupied = occupancy < said['free_thresh'], occupancy > said['occupied_thresh']
    assert ('occupied' if occupied else 'free' if free else 'unknown') == kind


def test_points_are_on_the_walls(output):
    vertices = PlyData.read(output / 'map.ply')['vertex']
    normals = np.stack([vertices[axis] for axis in ('nx', 'ny', 'nz')], axis=1)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    upright = np.abs(normals[:, 0]) > 0.99
    ahead = upright & (vertices['x'] > 2.5) & (np.abs(vertices['y']) < 2.0)
    assert ahead.sum() > 20
    assert abs(np.median(vertices['x'][ahead]) - 3.2) < 0.05


def test_the_trajectory_is_the_robot_s(output, recording):
    lines = np.loadtxt(output / 'trajectory.txt')
    stamps = [line.split()[0] for line in (output / 'trajectory.txt').read_text().splitlines()]
    assert all(len(stamp.split('.')[1]) == 9 for stamp in stamps)
    assert (np.diff(lines[:, 0]) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(lines[:, 4:], axis=1), 1.0, atol=1e-5)
    yaw = 2.0 * np.arctan2(lines[:, 6], lines[:, 7])
    seconds = [int(stamp.replace('.', '')) - START_NS for stamp in stamps]
    true = np.interp(
        seconds, recording.odometry_stamp_ns - START_NS, np.unwrap(recording.true_pose[:, 2])
    )
    off = [planar(0, 0, a) @ inverse(planar(0, 0, b)) for a, b in zip(yaw, true, strict=True)]
    assert max(abs(each[1, 0]) for each in off) < 0.01
    assert (output / 'map.png').stat().st_size > 10_000


def test_parameters_come_from_a_file(output, tmp_path):
    given = {'mapper': {'ros__parameters': {'resolution': 0.1, 'freedom': 'spatial'}}}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(given))
    bag = str(output.parent / 'bag')
    assert map_bag([bag, str(tmp_path / 'out'), '--params', str(tmp_path / 'map.yaml')]) == 0
    assert yaml.safe_load((tmp_path / 'out' / 'map.yaml').read_text())['resolution'] == 0.1


def test_a_folder_that_cannot_be_written_is_named_before_the_bag_is_read(tmp_path, capsys):
    (tmp_path / 'out' / 'keyframes.npz').mkdir(parents=True)
    assert map_bag([str(tmp_path / 'no_bag'), str(tmp_path / 'out')]) == 1
    assert 'keyframes.npz' in capsys.readouterr().err


@pytest.mark.parametrize('ego_motion', ['beam', 'off'])
def test_the_map_is_of_deskewed_sweeps_whatever_the_file_says(output, tmp_path, ego_motion):
    given = {'assembler': {'ros__parameters': {'ego_motion': ego_motion, 'cloud_mode': 'scan'}}}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(given))
    bag = str(output.parent / 'bag')
    assert map_bag([bag, str(tmp_path / 'out'), '--params', str(tmp_path / 'map.yaml')]) == 0
    found, expected = (np.loadtxt(each / 'trajectory.txt') for each in (tmp_path / 'out', output))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_file_says_how_the_joint_turns(output, recording, tmp_path):
    turned = replace(recording, joint_position=0.1 - recording.joint_position)
    write_bag(turned, tmp_path / 'bag')
    given = {'assembler': {'ros__parameters': {'joint_positive': 'down', 'joint_zero': 0.1}}}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(given))
    arguments = [str(tmp_path / name) for name in ('bag', 'out')]
    assert map_bag([*arguments, '--params', str(tmp_path / 'map.yaml')]) == 0
    found, expected = (np.loadtxt(each / 'trajectory.txt') for each in (tmp_path / 'out', output))
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_clouds_from_before_there_is_a_map_are_not_said_not_to_fit_it(tmp_path, capsys):
    # The first sweep ends 0.07 s after the recording began: a curve in space is no map.
    first_ns = START_NS + 70_000_000 - round(NOD.sweep_duration * 1e9)
    nod = replace(NOD, reference_time_ns=first_ns)
    seen = simulate(load_scene('room', 'turn'), nod, 4.0, 1, start_ns=START_NS)
    write_bag(seen, tmp_path / 'bag')
    assert map_bag([str(tmp_path / 'bag'), str(tmp_path / 'out')]) == 0
    assert re.search(r'clouds that do not fit the map +│ +0 │', capsys.readouterr().out)


def test_dropped_scans_are_named(recording, tmp_path, capsys):
    seconds = (recording.joint_stamp_ns - START_NS) / 1e9
    kept = (seconds < 5.0) | (seconds > 5.3)
    gap = replace(
        recording,
        joint_stamp_ns=recording.joint_stamp_ns[kept],
        joint_position=recording.joint_position[kept],
    )
    write_bag(gap, tmp_path / 'bag')
    assert map_bag([str(tmp_path / 'bag'), str(tmp_path / 'out')]) == 0
    assert 'dropped: joint samples more than 0.1 s apart' in capsys.readouterr().out


def test_late_odometry_is_named_until_its_delay_is_given(tmp_path, capsys):
    rates = np.array([0.0, 1.6, 0.0, 0.8, 0.0, -2.0, 0.0, -1.6, 0.0, 1.2])
    legs = tuple(Leg(1.5, (0.0, rate)) for rate in rates.tolist())
    turning = simulate(
        replace(load_scene('room'), base_legs=legs), NOD, 15.0, 1, start_ns=START_NS
    )
    late = replace(turning, odometry_stamp_ns=turning.odometry_stamp_ns + 100_000_000)
    write_bag(late, tmp_path / 'bag')
    arguments = [str(tmp_path / name) for name in ('bag', 'out')]
    assert map_bag(arguments) == 0
    said = re.search(r'set odometry_delay to (0\.\d+)', capsys.readouterr().out)
    assert said is not None
    assert 0.08 < float(said[1]) < 0.12
    given = {'assembler': {'ros__parameters': {'odometry_delay': 0.1}}}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(given))
    assert map_bag([*arguments, '--params', str(tmp_path / 'map.yaml')]) == 0
    told = capsys.readouterr().out
    assert 'odometry is late by' in told
    assert 'set odometry_delay' not in told


def test_stamps_of_odometry_that_jitter_are_named(tmp_path, capsys):
    scene = replace(load_scene('wall', ideal=True), base_legs=(Leg(3.0, (0.0, 0.8)),))
    steady = simulate(scene, NOD, 2.0, 1, start_ns=START_NS)
    late_ns = np.random.default_rng(1).exponential(20e6, len(steady.odometry_stamp_ns))
    stamps_ns = np.sort(steady.odometry_stamp_ns + late_ns.astype(np.int64))
    stamps_ns[[0, -1]] = steady.odometry_stamp_ns[[0, -1]]
    write_bag(replace(steady, odometry_stamp_ns=stamps_ns), tmp_path / 'bag')
    assert map_bag([str(tmp_path / name) for name in ('bag', 'out')]) == 0
    told = re.sub(r'[\s│]+', ' ', capsys.readouterr().out)
    assert 'its stamps jitter by' in told
    assert 'set odometry_period to 0.0200 in assembler and mapper' in told


def test_it_is_said_why_the_delay_of_odometry_is_unknown(output, tmp_path, capsys):
    assert map_bag([str(output.parent / 'bag'), str(tmp_path / 'out')]) == 0
    printed = ' '.join(re.sub('[│\n]', ' ', capsys.readouterr().out).split())
    assert 'odometry is late by unknown: too few clouds without a jump of odometry' in printed


@pytest.mark.parametrize(
    ('name', 'value'), [('resolution', 0.0), ('freedom', 'flat'), ('extend_map', False)]
)
def test_what_is_not_allowed_is_named(output, tmp_path, capsys, name, value):
    given = {'mapper': {'ros__parameters': {name: value}}}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(given))
    bag = str(output.parent / 'bag')
    assert map_bag([bag, str(tmp_path / 'out'), '--params', str(tmp_path / 'map.yaml')]) == 2
    assert name in capsys.readouterr().err


def test_of_a_recording_that_was_cut_off_the_rest_is_mapped(output, tmp_path, capsys):
    """The recorder was killed at the beginning of the second file."""
    (tmp_path / 'bag').mkdir()
    (file,) = (output.parent / 'bag').glob('*.mcap')
    (tmp_path / 'bag' / 'bag_0.mcap').write_bytes(file.read_bytes())
    (tmp_path / 'bag' / 'bag_1.mcap').write_bytes(file.read_bytes()[:1000])
    assert map_bag([str(tmp_path / 'bag'), str(tmp_path / 'out')]) == 0
    found, expected = (np.loadtxt(each / 'trajectory.txt') for each in (tmp_path / 'out', output))
    np.testing.assert_array_equal(found, expected)
    assert "'bag_1.mcap' ends early: read up to there" in capsys.readouterr().out


def test_a_missing_bag_is_one_line(tmp_path, capsys):
    assert map_bag([str(tmp_path / 'none'), str(tmp_path / 'out')]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_bag_without_a_whole_sweep_is_one_line(tmp_path, capsys):
    short = simulate(load_scene('room', 'turn'), NOD, 0.35, 1, start_ns=START_NS)
    write_bag(short, tmp_path / 'bag')
    assert map_bag([str(tmp_path / 'bag'), str(tmp_path / 'out')]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert 'no cloud from 3 scans: no whole sweep' in line


def test_slow_odometry_is_used_as_the_parameters_allow(recording, tmp_path):
    slow = replace(
        recording,
        odometry_stamp_ns=recording.odometry_stamp_ns[::25],
        odometry_pose=recording.odometry_pose[::25],
        true_pose=recording.true_pose[::25],
    )
    assert np.diff(slow.odometry_stamp_ns).min() > 0.2e9  # the default
    write_bag(slow, tmp_path / 'bag')
    given = {'assembler': {'ros__parameters': {'max_odometry_gap': 1.0}}}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(given))
    folders = [str(tmp_path / name) for name in ('bag', 'out')]
    assert map_bag([*folders, '--params', str(tmp_path / 'map.yaml')]) == 0


def test_a_silence_of_odometry_counts_from_the_cloud_before():
    times_ns = np.concatenate([np.arange(0, 2000, 20), np.arange(12_000, 14_000, 20)]) * 10**6
    log = SimpleNamespace(odometry=SimpleNamespace(time_ns=times_ns))
    for begin, end, silent in (
        (1.0, 1.9, 0.0),
        (1.0, 13.0, 10.02),
        (5.0, 13.0, 7.0),
        (12.0, 13.0, 0.0),
    ):
        found = silence_between(log, round(begin * 1e9), round(end * 1e9))
        assert found == pytest.approx(silent)
