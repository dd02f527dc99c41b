"""The parameter files for SLAM programs: names as in their sources, values as ours."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.profiles import PROFILES
from nodlidar_mapper.live import NodeConfig
from nodlidar_sim.world.sensor_model import SensorModel
import pytest
import yaml

FOLDER = Path(get_package_share_directory('nodlidar_bringup')) / 'config' / 'slam'
# As declared by OdometryServer.cpp of kiss-icp 1.2 and octomap_server.cpp of octomap_mapping 2.
DECLARED = {
    'kiss_icp': {
        'base_frame',
        'lidar_odom_frame',
        'publish_odom_tf',
        'invert_odom_tf',
        'publish_debug_clouds',
        'position_covariance',
        'orientation_covariance',
        'max_range',
        'min_range',
        'deskew',
        'voxel_size',
        'max_points_per_voxel',
        'initial_threshold',
        'min_motion_th',
        'max_num_iterations',
        'convergence_criterion',
        'max_num_threads',
    },
    'octomap_server': {
        'frame_id',
        'base_frame_id',
        'resolution',
        'sensor_model',
        'latch',
        'filter_ground_plane',
        'filter_speckles',
    },
}


def parameters(name):
    return yaml.safe_load((FOLDER / f'{name}.yaml').read_text())['/**']['ros__parameters']


@pytest.mark.parametrize('name', DECLARED)
def test_each_parameter_is_one_of_the_program(name):
    assert set(parameters(name)) <= DECLARED[name]


def test_there_is_no_file_that_is_not_checked():
    assert {path.stem for path in FOLDER.iterdir()} == set(DECLARED)


def test_frames_are_those_of_the_launch_file():
    frames = NodeConfig()
    kiss, octomap = parameters('kiss_icp'), parameters('octomap_server')
    assert kiss['base_frame'] == octomap['base_frame_id'] == frames.base_frame
    assert octomap['frame_id'] == frames.map_frame
    # A second parent of base_link would break TF.
    assert kiss['lidar_odom_frame'] != frames.odom_frame or not kiss['publish_odom_tf']


def test_ranges_are_those_of_the_lidar():
    sensor = SensorModel()
    kiss = parameters('kiss_icp')
    assert (kiss['min_range'], kiss['max_range']) == (sensor.range_min, sensor.range_max)
    assert parameters('octomap_server')['sensor_model']['max_range'] == sensor.range_max


def test_clouds_are_not_deskewed_twice():
    assert PROFILES['slam'].ego_motion == 'deskew'
    assert parameters('kiss_icp')['deskew'] is False
