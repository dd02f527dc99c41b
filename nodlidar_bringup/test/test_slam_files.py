"""The parameter files for SLAM programs: names as in their sources, values as ours."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.profiles import PROFILES
from nodlidar_mapper.live import NodeConfig
from nodlidar_sim.world.sensor_model import SensorModel
import pytest
import yaml

FOLDER = Path(get_package_share_directory('nodlidar_bringup')) / 'config' / 'slam'
# As declared by OdometryServer.cpp of kiss-icp after 1.2.3 (up to it without groups) and
# octomap_server.cpp of octomap_mapping 2.1.
DECLARED = {
    'kiss_icp': {
        'base_frame',
        'lidar_odom_frame',
        'publish_odom_tf',
        'invert_odom_tf',
        'publish_debug_clouds',
        'position_covariance',
        'orientation_covariance',
        'data.max_range',
        'data.min_range',
        'data.deskew',
        'mapping.voxel_size',
        'mapping.max_points_per_voxel',
        'adaptive_threshold.initial_threshold',
        'adaptive_threshold.min_motion_th',
        'registration.max_num_iterations',
        'registration.convergence_criterion',
        'registration.max_num_threads',
    },
    'octomap_server': {
        'frame_id',
        'base_frame_id',
        'resolution',
        'sensor_model.max_range',
        'sensor_model.hit',
        'sensor_model.miss',
        'sensor_model.min',
        'sensor_model.max',
        'point_cloud_min_z',
        'point_cloud_max_z',
        'occupancy_min_z',
        'occupancy_max_z',
        'filter_ground_plane',
        'filter_speckles',
        'publish_free_space',
        'latch',
    },
}


def parameters(name):
    content = yaml.safe_load((FOLDER / f'{name}.yaml').read_text())
    return flat(content['/**']['ros__parameters'])


def flat(tree):
    """Return the parameters of nested groups, named as ROS names them."""
    named = {}
    for name, value in tree.items():
        if isinstance(value, dict):
            named |= {f'{name}.{key}': each for key, each in flat(value).items()}
        else:
            named[name] = value
    return named


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
    assert (kiss['data.min_range'], kiss['data.max_range']) == (sensor.range_min, sensor.range_max)
    assert parameters('octomap_server')['sensor_model.max_range'] == sensor.range_max


def test_clouds_are_not_deskewed_twice():
    assert PROFILES['slam'].ego_motion == 'deskew'
    assert parameters('kiss_icp')['data.deskew'] is False
