"""The demo of the mapper, on a short drive."""

from contextlib import suppress
import errno
import os
import shutil

from matplotlib.image import imread
from nodlidar_common.errors import ParameterError
from nodlidar_demo.commands import demo_mapping as module
from nodlidar_demo.commands.entry_points import demo_mapping
from nodlidar_demo.options import new_bag
import numpy as np
import pytest


def test_a_drive_leaves_a_map_beside_the_true_floor_plan(tmp_path):
    output = tmp_path / 'out'
    assert demo_mapping(['--scene', 'corridor', '--duration', '8', '--output', str(output)]) == 0
    names = {path.name for path in output.iterdir()}
    assert names >= {'bag', 'map.ply', 'map.pgm', 'map.yaml', 'trajectory.txt', 'floor_plan.png'}
    picture = imread(output / 'floor_plan.png')[:, :, :3]
    dark = (picture < 0.2).all(axis=2)
    half = picture.shape[1] // 2
    for side in (dark[:, :half], dark[:, half:]):
        # Walls: far more dark pixels than the frame and the letters have.
        assert np.count_nonzero(side) > 4000


def test_a_missing_scene_is_named(tmp_path, capsys):
    assert demo_mapping(['--scene', 'moon', '--output', str(tmp_path)]) == 2
    assert 'moon' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('option', 'value'),
    [('--duration', 'nan'), ('--duration', 'inf'), ('--duration', '0'), ('--seed', '-1')],
)
def test_an_option_without_sense_is_named_with_what_is_allowed(tmp_path, capsys, option, value):
    assert demo_mapping([option, value, '--output', str(tmp_path)]) == 2
    assert f"'{option}' must be" in capsys.readouterr().err


def test_the_bag_of_an_earlier_demo_is_replaced_and_no_other(tmp_path, capsys):
    bag = tmp_path / 'bag'
    bag.mkdir()
    (bag / 'mine').touch()
    with pytest.raises(ParameterError, match='earlier demo'), new_bag(tmp_path):
        pass
    assert demo_mapping(['--output', str(tmp_path)]) == 2
    assert (bag / 'mine').exists()
    (bag / 'mine').unlink()
    bag.rmdir()
    for _ in range(2):
        with new_bag(tmp_path) as mine:
            assert not mine.exists()
            mine.mkdir()
    shutil.rmtree(bag)
    with suppress(KeyboardInterrupt), new_bag(tmp_path) as mine:
        mine.mkdir()
        raise KeyboardInterrupt  # a demo that was ended early
    with new_bag(tmp_path):
        pass  # one that ended before it wrote a bag
    bag.mkdir()
    with pytest.raises(ParameterError, match='earlier demo'), new_bag(tmp_path):
        pass


def test_a_full_disk_is_told_with_the_path(tmp_path, capsys, monkeypatch):
    """As rosbags raises it: without a path."""

    def full(drive, path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(module, 'write_bag', full)
    arguments = ['--scene', 'corridor', '--duration', '1', '--output', str(tmp_path)]
    assert demo_mapping(arguments) == 1
    assert f"No space left on device: '{tmp_path / 'bag'}'" in capsys.readouterr().err
