"""A saved map: loaded again as it was, continued, and refused if damaged."""

from dataclasses import replace
import errno
import os
import subprocess
import sys

from hypothesis import given, settings
from hypothesis import strategies as st
from nodlidar_common.errors import ParameterError
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.geometry.poses import planar
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.output import map_files
from nodlidar_mapper.output.grid import GridConfig
from nodlidar_mapper.output.saved_map import load_keyframes, save_keyframes, SavedMapError
import numpy as np
import pytest
from rooms import cloud, CROOKED

NS = 10**9


def drive(mapper, seed=0, count=12):
    """Map the room on an arc."""
    for k in range(count):
        pose = planar(0.3 * k - 1.5, 0.1 * k - 0.5, 0.1 * k)
        points = cloud(CROOKED, pose, seed=seed + k)
        age = np.linspace(0.7, 0.0, len(points))
        mapper.add(Cloud(k * NS, points, pose, planar(0.2, 0.0, 0.3), age))
    return mapper


@pytest.fixture(scope='module')
def mapper():
    return drive(Mapper(MapConfig()))


@pytest.fixture(scope='module')
def saved(mapper, tmp_path_factory):
    path = tmp_path_factory.mktemp('map') / 'keyframes.npz'
    save_keyframes(path, mapper.map.keyframes, mapper.map.edges)
    return path


# In a process of its own: the limit counts for all that a process writes.
SAVE_ON_A_FULL_DISK = """
from pathlib import Path
import resource
import signal
import sys

from nodlidar_mapper.output.saved_map import load_keyframes, save_keyframes

keyframes, edges = load_keyframes(Path(sys.argv[1]))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]), resource.RLIM_INFINITY))
try:
    save_keyframes(Path(sys.argv[2]), keyframes, edges)
except OSError as error:
    print(error)
"""


@pytest.mark.parametrize('missing', [1, 5000])
def test_on_a_full_disk_the_map_of_before_is_kept_and_one_error_told(saved, tmp_path, missing):
    path = tmp_path / 'keyframes.npz'
    path.write_text('before')
    size = str(saved.stat().st_size - missing)
    command = [sys.executable, '-c', SAVE_ON_A_FULL_DISK, str(saved), str(path), size]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert str(path) in done.stdout
    assert done.stderr == ''
    assert path.read_text() == 'before'
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize('writer', ['write_grid', 'write_path', 'save_keyframes', 'write_picture'])
def test_of_a_map_that_cannot_be_saved_whole_no_file_is(mapper, tmp_path, monkeypatch, writer):
    def write(keyframes):
        poses = np.stack([keyframe.pose for keyframe in keyframes])
        stamps_ns = [keyframe.stamp_ns for keyframe in keyframes]
        snapshot = MapSnapshot(None, keyframes, [], 0, stamps_ns, poses)
        map_files.write_map(tmp_path, snapshot, GridConfig())
        return {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def fail(*_args):
        raise OSError(errno.ENOSPC, 'No space left on device', 'a file')

    before = write(mapper.map.keyframes[:2])
    with monkeypatch.context() as patch:
        patch.setattr(map_files, writer, fail)
        with pytest.raises(OSError, match='No space left on device') as caught:
            write(mapper.map.keyframes)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert caught.value.filename == str(tmp_path)
    after = write(mapper.map.keyframes)
    assert all(after[name] != content for name, content in before.items() if name != 'map.yaml')


def test_a_map_comes_back_to_a_micrometre(mapper, saved):
    keyframes, edges = load_keyframes(saved)
    assert len(keyframes) == len(mapper.map.keyframes) > 3
    for before, after in zip(mapper.map.keyframes, keyframes, strict=True):
        assert after.stamp_ns == before.stamp_ns
        assert len(after.cloud.points) > 1000
        np.testing.assert_array_equal(after.pose, before.pose)
        np.testing.assert_allclose(after.surface.points, before.surface.points, atol=1e-6)
        np.testing.assert_allclose(after.surface.normals, before.surface.normals, atol=1e-6)
        np.testing.assert_allclose(after.cloud.points, before.cloud.points, atol=1e-6)
        np.testing.assert_allclose(after.cloud.origins, before.cloud.origins, atol=1e-6)
        np.testing.assert_allclose(after.robot, before.robot, atol=1e-12)
    for before, after in zip(mapper.map.edges, edges, strict=True):
        assert (after.start, after.end) == (before.start, before.end)
        np.testing.assert_array_equal(after.relative, before.relative)
        np.testing.assert_array_equal(after.information, before.information)


@pytest.mark.parametrize('extend', [True, False])
def test_the_robot_is_found_anywhere_in_a_loaded_map(saved, extend):
    config = MapConfig(extend_map=extend)
    mapper = Mapper(config, *load_keyframes(saved))
    size = len(mapper.map.keyframes)
    true, odometry = planar(1.5, 1.5, -2.0), planar(7.0, -3.0, 0.4)
    found = [
        mapper.add(Cloud(k * NS, cloud(CROOKED, true, seed=50 + k), odometry)) for k in range(6)
    ]
    assert found[0].lost
    assert not found[-1].lost
    np.testing.assert_allclose(found[-1].pose, true, atol=0.02)
    assert (len(mapper.map.keyframes) > size) == extend


def test_a_map_that_must_not_grow_has_to_be_loaded():
    with pytest.raises(ParameterError, match=r'extend_map.*map_folder'):
        Mapper(MapConfig(extend_map=False))


def test_without_a_frame_in_common_the_robot_is_not_found(saved):
    mapper = Mapper(MapConfig(), *load_keyframes(saved))
    other = np.array([(-9.0, -1.0), (3.0, -1.0), (3.0, 1.2), (-9.0, 0.5)])
    for k in range(3):
        assert mapper.add(Cloud(k * NS, cloud(other, np.eye(4), seed=k), np.eye(4))).lost


@settings(max_examples=30)
@given(st.data())
def test_a_damaged_file_is_refused_or_the_same(saved, tmp_path_factory, data):
    content = bytearray(saved.read_bytes())
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content) - 1)) :]
    else:
        content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path = tmp_path_factory.mktemp('damaged') / 'keyframes.npz'
    path.write_bytes(content)
    try:
        keyframes, _ = load_keyframes(path)
    except SavedMapError:
        return
    for before, after in zip(load_keyframes(saved)[0], keyframes, strict=True):
        np.testing.assert_array_equal(after.pose, before.pose)


@pytest.mark.parametrize(
    'change',
    [
        {'format': np.array(1)},
        {'pose': np.zeros((2, 4, 4))},
        {'edge': np.array([[0, 99]])},
        {'cloud': np.full((5, 3), np.nan, dtype=np.float32)},
        {'stamp_ns': np.zeros(0, dtype=np.int64)},
        {'surface_counts': np.zeros(3)},
    ],
)
def test_arrays_that_are_no_map_are_refused(saved, tmp_path, change):
    with np.load(saved) as file:
        arrays = {name: file[name] for name in file.files} | change
    path = tmp_path / 'keyframes.npz'
    np.savez(path, **arrays)
    with pytest.raises(SavedMapError, match='is not a map'):
        load_keyframes(path)


@pytest.mark.parametrize(
    ('name', 'spoil'),
    [
        ('pose', np.zeros_like),
        ('pose', lambda pose: 1.01 * pose),
        ('pose', lambda pose: pose * [1.0, 1.0, -1.0, 1.0]),  # mirrored
        ('relative', lambda relative: relative + np.eye(4)),
        ('surface', lambda surface: 2.0 * surface),
        ('information', np.negative),
        ('information', np.triu),
    ],
)
def test_arrays_of_values_that_no_map_has_are_refused(saved, tmp_path, name, spoil):
    with np.load(saved) as file:
        arrays = {each: file[each] for each in file.files}
    path = tmp_path / 'keyframes.npz'
    np.savez(path, **arrays | {name: spoil(arrays[name])})
    with pytest.raises(SavedMapError, match=f'is not a map: .*{name} is'):
        load_keyframes(path)


@pytest.mark.parametrize('left', [0, 1])
def test_keyframes_that_no_edge_leads_to_are_refused(mapper, tmp_path, left):
    path = tmp_path / 'keyframes.npz'
    save_keyframes(path, mapper.map.keyframes, mapper.map.edges[:left])
    with pytest.raises(SavedMapError, match='is not a map: edges do not join all keyframes'):
        load_keyframes(path)


def test_a_directory_of_arrays_that_begins_too_late_is_no_error_of_the_disk(saved, tmp_path):
    content = bytearray(saved.read_bytes())
    begin = int.from_bytes(content[-6:-2], 'little')  # in the last record of a zip file
    content[-6:-2] = (begin + 1000).to_bytes(4, 'little')  # its first file then begins before 0
    path = tmp_path / 'keyframes.npz'
    path.write_bytes(content)
    with pytest.raises(SavedMapError, match='is not a map'):
        load_keyframes(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(OSError, match=r'keyframes\.npz'):
        load_keyframes(tmp_path / 'keyframes.npz')


def test_a_file_of_pickles_is_not_run(tmp_path):
    np.savez(tmp_path / 'keyframes.npz', format=np.array([replace], dtype=object))
    with pytest.raises(SavedMapError):
        load_keyframes(tmp_path / 'keyframes.npz')


def test_a_pipe_in_the_place_of_a_map_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / 'keyframes.npz')
    with pytest.raises(SavedMapError, match='is not a map: it is no file'):
        load_keyframes(tmp_path / 'keyframes.npz')
