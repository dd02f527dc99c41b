"""The parameter files for SLAM programs: names as in their sources, values as ours."""

import math
from pathlib import Path
import re

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.clouds.level_ranges import LevelScanConfig
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import PROFILES
from nodlidar_mapper.config import NodeConfig
from nodlidar_sim.world.sensor_model import SensorModel
import pytest
import yaml

FOLDER = Path(get_package_share_directory('nodlidar_bringup')) / 'config' / 'slam'
SOURCE = """topic data_type marking clearing inf_is_valid min_obstacle_height max_obstacle_height
    obstacle_max_range obstacle_min_range raytrace_max_range raytrace_min_range sensor_frame
    observation_persistence expected_update_rate"""
# Checked on its own, and by the launch.
OTHERS = {'cartographer.lua', 'level_scan.yaml'}
# As declared by the sources of the programs: some of the names of each.
DECLARED = {
    # OdometryServer.cpp of kiss-icp after 1.2.3; up to 1.2.3 without groups
    'kiss_icp.yaml': """base_frame lidar_odom_frame publish_odom_tf invert_odom_tf
        publish_debug_clouds position_covariance orientation_covariance data.max_range
        data.min_range data.deskew mapping.voxel_size mapping.max_points_per_voxel
        adaptive_threshold.initial_threshold adaptive_threshold.min_motion_th
        registration.max_num_iterations registration.convergence_criterion
        registration.max_num_threads""",
    # octomap_server.cpp of octomap_mapping 2.1
    'octomap_server.yaml': """frame_id base_frame_id resolution sensor_model.max_range
        sensor_model.hit sensor_model.miss sensor_model.min sensor_model.max point_cloud_min_z
        point_cloud_max_z occupancy_min_z occupancy_max_z filter_ground_plane filter_speckles
        publish_free_space latch""",
    # slam_toolbox_common.cpp, laser_utils.cpp and Mapper.cpp of slam_toolbox 2.7
    'slam_toolbox.yaml': """odom_frame map_frame base_frame scan_topic mode max_laser_range
        resolution minimum_time_interval throttle_scans minimum_travel_distance
        minimum_travel_heading scan_buffer_size scan_buffer_maximum_scan_distance
        scan_queue_size transform_timeout use_map_saver map_update_interval""",
    # amcl_node.cpp of Navigation2 for Jazzy (1.3)
    'amcl.yaml': """base_frame_id odom_frame_id global_frame_id scan_topic laser_model_type
        laser_max_range laser_min_range update_min_d update_min_a max_beams max_particles
        min_particles transform_tolerance tf_broadcast resample_interval sigma_hit""",
    # costmap_2d_ros.cpp, obstacle_layer.cpp and voxel_layer.cpp of Navigation2 for Jazzy (1.3)
    'nav2_costmap.yaml': ' '.join(
        [
            'global_frame robot_base_frame plugins',
            'obstacle_layer.plugin obstacle_layer.observation_sources',
            'voxel_layer.plugin voxel_layer.observation_sources voxel_layer.origin_z',
            'voxel_layer.z_resolution voxel_layer.z_voxels inflation_layer.plugin',
            *(
                f'obstacle_layer.{each}.{key}'
                for each in ('level_hits', 'level_free')
                for key in SOURCE.split()
            ),
            *(
                f'voxel_layer.{each}.{key}'
                for each in ('cloud_marks', 'cloud_clears')
                for key in SOURCE.split()
            ),
        ]
    ),
    # CoreWrapper.cpp, CommonDataSubscriber.cpp of rtabmap_ros 0.22, and Parameters.h of rtabmap
    'rtabmap.yaml': """frame_id map_frame_id odom_frame_id subscribe_odom_info
        subscribe_scan_cloud subscribe_scan subscribe_depth subscribe_rgb approx_sync
        wait_for_transform delete_db_on_start publish_tf
        Reg/Strategy Reg/Force3DoF RGBD/NeighborLinkRefining
        RGBD/ProximityBySpace RGBD/ProximityPathMaxNeighbors RGBD/LinearUpdate
        RGBD/AngularUpdate Rtabmap/DetectionRate Icp/VoxelSize Icp/PointToPlane
        Icp/PointToPlaneK Icp/MaxCorrespondenceDistance Grid/Sensor Grid/RangeMax Grid/3D
        Grid/RayTracing Grid/NormalsSegmentation Grid/MaxGroundHeight Grid/MaxObstacleHeight""",
}
# node_options.cc and trajectory_options.cc of cartographer_ros in 2022, which want all of them.
CARTOGRAPHER = """map_builder trajectory_builder map_frame tracking_frame published_frame
    odom_frame provide_odom_frame publish_frame_projected_to_2d use_pose_extrapolator
    use_odometry use_nav_sat use_landmarks num_laser_scans num_multi_echo_laser_scans
    num_subdivisions_per_laser_scan num_point_clouds lookup_transform_timeout_sec
    submap_publish_period_sec pose_publish_period_sec trajectory_publish_period_sec
    rangefinder_sampling_ratio odometry_sampling_ratio fixed_frame_pose_sampling_ratio
    imu_sampling_ratio landmarks_sampling_ratio"""
FRAMES = NodeConfig()


def parameters(name):
    tree = yaml.safe_load((FOLDER / name).read_text())
    while 'ros__parameters' not in tree:
        [tree] = tree.values()
    return flat(tree['ros__parameters'])


def flat(tree):
    """Return the parameters of nested groups, named as ROS names them."""
    named = {}
    for name, value in tree.items():
        if isinstance(value, dict):
            named |= {f'{name}.{key}': each for key, each in flat(value).items()}
        else:
            named[name] = value
    return named


def lua_options(text):
    """Return the entries of the table `options`, and what is assigned after it, as text."""
    return dict(re.findall(r'^ *([\w.]+) = (.*?),?$', re.sub('--.*', '', text), re.MULTILINE))


@pytest.fixture
def cartographer():
    return lua_options((FOLDER / 'cartographer.lua').read_text())


@pytest.mark.parametrize('name', DECLARED)
def test_each_parameter_is_one_of_the_program(name):
    assert set(parameters(name)) <= set(DECLARED[name].split())


def test_cartographer_has_all_options_that_it_wants(cartographer):
    options = {key for key in cartographer if '.' not in key} - {'options'}
    assert options == set(CARTOGRAPHER.split())


def test_there_is_no_file_that_is_not_checked():
    assert {path.name for path in FOLDER.iterdir()} == {*DECLARED, *OTHERS}


def test_the_page_names_each_file_and_no_other():
    page = (Path(__file__).parents[2] / 'docs' / 'slam.md').read_text()
    commands = '\n'.join(re.findall(r'```\n(.*?)```', page, re.DOTALL))
    named = set(re.findall(r'\w+\.(?:yaml|lua)', commands)) | {'nav2_costmap.yaml'}
    assert 'config/slam/nav2_costmap.yaml' in page
    assert named == {*DECLARED, *OTHERS}


@pytest.mark.parametrize(
    ('name', 'base', 'odom', 'fixed'),
    [
        ('kiss_icp.yaml', 'base_frame', None, None),
        ('octomap_server.yaml', 'base_frame_id', None, 'frame_id'),
        ('slam_toolbox.yaml', 'base_frame', 'odom_frame', 'map_frame'),
        ('amcl.yaml', 'base_frame_id', 'odom_frame_id', 'global_frame_id'),
        ('nav2_costmap.yaml', 'robot_base_frame', 'global_frame', None),
        ('rtabmap.yaml', 'frame_id', 'odom_frame_id', 'map_frame_id'),
    ],
)
def test_frames_are_those_of_the_launch_file(name, base, odom, fixed):
    found = parameters(name)
    ours = {base: FRAMES.base_frame, odom: FRAMES.odom_frame, fixed: FRAMES.map_frame}
    assert all(found[key] == frame for key, frame in ours.items() if key is not None)


def test_frames_of_cartographer_are_those_of_the_launch_file(cartographer):
    frames = FRAMES.map_frame, FRAMES.base_frame, FRAMES.odom_frame
    keys = ('map_frame', 'tracking_frame', 'published_frame')
    assert [cartographer[key] for key in keys] == [f'"{frame}"' for frame in frames]
    assert cartographer['provide_odom_frame'] == 'false'


def test_kiss_icp_is_no_second_parent_of_the_robot():
    kiss = parameters('kiss_icp.yaml')
    assert kiss['lidar_odom_frame'] != FRAMES.odom_frame or not kiss['publish_odom_tf']


def test_ranges_of_clouds_are_those_of_the_lidar():
    sensor = SensorModel()
    kiss, costmap = parameters('kiss_icp.yaml'), parameters('nav2_costmap.yaml')
    assert (kiss['data.min_range'], kiss['data.max_range']) == (sensor.range_min, sensor.range_max)
    assert parameters('octomap_server.yaml')['sensor_model.max_range'] == sensor.range_max
    assert costmap['voxel_layer.cloud_clears.raytrace_max_range'] == sensor.range_max
    assert float(parameters('rtabmap.yaml')['Grid/RangeMax']) == sensor.range_max


def test_ranges_of_level_scans_are_those_of_the_assembler(cartographer):
    config, costmap = LevelScanConfig(), parameters('nav2_costmap.yaml')
    assert parameters('slam_toolbox.yaml')['max_laser_range'] == config.level_scan_range
    assert float(cartographer['TRAJECTORY_BUILDER_2D.max_range']) == config.level_scan_range
    layer = 'obstacle_layer.level_'
    assert costmap[f'{layer}hits.raytrace_max_range'] == config.level_scan_range
    # Else +inf, at range_max, would mark; and clear what is not known to be free.
    assert costmap[f'{layer}hits.obstacle_max_range'] < config.level_scan_range
    assert not costmap[f'{layer}free.marking']
    assert costmap[f'{layer}free.raytrace_max_range'] <= config.level_scan_free


def test_level_scans_clear_only_where_the_nod_sees_the_floor_of_the_band():
    """Below the band, the lidar's lowest beam enters it at the range from which they clear."""
    config, costmap = AssemblerConfig(), parameters('nav2_costmap.yaml')
    lever, down = LevelScanConfig().laser_xyz[2], -config.pitch_min
    height = config.sensor_height - lever + lever * math.cos(down) - config.band_bottom
    seen = height / math.tan(down) + lever * math.sin(down)
    for source in ('hits', 'free'):
        nearest = costmap[f'obstacle_layer.level_{source}.raytrace_min_range']
        assert seen - 0.05 < nearest < seen + 0.05


def test_a_costmap_without_news_for_three_sweeps_is_not_current():
    config, costmap = AssemblerConfig(), parameters('nav2_costmap.yaml')
    sweep = config.samples_per_sweep * config.task.beam_period
    times = [value for key, value in costmap.items() if key.endswith('expected_update_rate')]
    assert len(times) == 4
    assert all(3.0 * sweep < time < 4.0 * sweep for time in times)


def test_topics_are_those_of_the_assembler():
    costmap = parameters('nav2_costmap.yaml')
    topics = {key.split('.')[1]: value for key, value in costmap.items() if key.endswith('topic')}
    assert topics == {
        'level_hits': '/level_scan', 'level_free': '/level_scan',
        'cloud_marks': '/points', 'cloud_clears': '/points',
    }  # fmt: skip  # Nav2 of Jazzy takes relative names as of the costmap's own namespace
    assert parameters('amcl.yaml')['scan_topic'] == 'level_scan'
    assert parameters('slam_toolbox.yaml')['scan_topic'] == 'level_scan'


@pytest.mark.parametrize(
    ('name', 'key'),
    [('slam_toolbox.yaml', 'transform_timeout'), ('amcl.yaml', 'transform_tolerance')],
)
def test_map_to_odom_outlasts_a_sweep_and_the_delay_of_its_scan(name, key):
    config = AssemblerConfig()
    sweep = config.samples_per_sweep * config.task.beam_period
    assert parameters(name)[key] > sweep + config.deadline


def test_the_costmap_marks_the_band_of_the_assembler_and_clears_by_all_points():
    band, costmap = AssemblerConfig(), parameters('nav2_costmap.yaml')
    marks, clears = (f'voxel_layer.cloud_{each}.' for each in ('marks', 'clears'))
    assert costmap[f'{marks}min_obstacle_height'] == band.band_bottom
    assert costmap[f'{marks}max_obstacle_height'] == band.band_top
    assert costmap[f'{clears}min_obstacle_height'] < 0.0
    assert costmap[f'{clears}max_obstacle_height'] > costmap[f'{marks}max_obstacle_height']
    # The rays begin in the voxels.
    top = costmap['voxel_layer.z_voxels'] * costmap['voxel_layer.z_resolution']
    assert costmap['voxel_layer.origin_z'] < band.sensor_height < top
    for layer in ('obstacle_layer', 'voxel_layer'):
        sources = costmap[f'{layer}.observation_sources'].split()
        named = {
            key.split('.')[1] for key in costmap if key.startswith(layer) and key.count('.') > 1
        }
        assert set(sources) == named


def test_clouds_are_not_deskewed_twice():
    assert PROFILES['slam'].ego_motion == 'deskew'
    assert parameters('kiss_icp.yaml')['data.deskew'] is False
