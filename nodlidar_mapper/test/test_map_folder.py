"""The folder of a map, and its picture."""

from pathlib import Path

from matplotlib.image import imread
from nodlidar_mapper.cloud import Cloud
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.live import LiveMapper
from nodlidar_mapper.mapper import Mapper
from nodlidar_mapper.output.grid import Grid, GridConfig
from nodlidar_mapper.output.map_folder import load, save
from nodlidar_mapper.output.picture import write_picture
import numpy as np
import pytest
from rooms import cloud, OBLONG


def test_a_map_is_saved_and_loaded_below_home(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    mapper = LiveMapper(Mapper(MapConfig()))
    snapshot = mapper.add(Cloud(0, cloud(OBLONG, np.eye(4)), np.eye(4)))
    save(Path('~/map'), snapshot, GridConfig())
    assert (tmp_path / 'map' / 'map.png').exists()
    keyframes, _ = load(Path('~/map'))
    assert len(keyframes) == len(snapshot.keyframes)


def test_a_missing_map_is_named_with_the_folder_of_the_node(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileNotFoundError) as caught:
        load(Path('my_map'))
    assert caught.value.filename == f'{tmp_path}/my_map/keyframes.npz'


@pytest.mark.parametrize('shape', [(6000, 80), (80, 6000), (200, 200)])
def test_a_picture_of_a_long_corridor_is_no_larger_than_others(tmp_path, shape):
    grid = Grid(np.zeros(shape, dtype=np.int8), (0.0, 0.0), 0.05)
    write_picture(tmp_path / 'map.png', grid, np.eye(4)[None])
    rows, columns, _ = imread(tmp_path / 'map.png').shape
    assert max(rows, columns) < 1200
    assert min(rows, columns) > 300
