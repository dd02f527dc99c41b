"""The commands that start SLAM programs: a node of ours takes their arguments.

The programs are not there, but ROS reads remappings and parameter files for them.
"""

from pathlib import Path
import re
import shlex

from ament_index_python.packages import get_package_share_directory
import pytest
import rclpy

FOLDER = Path(get_package_share_directory('nodlidar_bringup')) / 'config' / 'slam'
PAGE = Path(__file__).parents[2] / 'docs' / 'slam.md'
# The topic that a program subscribes to, which the command remaps, by its source; and ours.
TOPICS = {
    'kiss_icp': ('pointcloud_topic', '/points'),
    'octomap_server': ('cloud_in', '/points'),
    'rtabmap_slam': ('scan_cloud', '/points'),
    'cartographer_ros': ('scan', '/level_scan'),
    'nav2_amcl': ('level_scan', '/level_scan'),  # by the parameter scan_topic
}


def commands():
    """Return the words of each command of the page that starts another project's node."""
    blocks = re.findall(r'^```\n(.*?)^```', PAGE.read_text(), re.DOTALL | re.MULTILINE)
    lines = '\n'.join(blocks).replace('\\\n', '').splitlines()
    return [shlex.split(line) for line in lines if line.startswith('ros2 run ')]


def test_each_program_is_known():
    assert {words[2] for words in commands()} == set(TOPICS)


@pytest.mark.parametrize('words', commands(), ids=lambda words: words[2])
def test_ros_takes_remappings_and_parameters(words, monkeypatch):
    monkeypatch.chdir(FOLDER)  # where the page says that the files are
    arguments = words[words.index('--ros-args') :]
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node(
        words[3],
        context=context,
        cli_args=arguments,
        use_global_arguments=False,
        automatically_declare_parameters_from_overrides=True,
    )
    theirs, ours = TOPICS[words[2]]
    found, parameters = node.resolve_topic_name(theirs), node.get_parameters_by_prefix('')
    node.destroy_node()
    rclpy.shutdown(context=context)
    assert found == ours
    if '--params-file' in arguments:
        assert len(parameters) > 5  # the node has two of its own
    else:
        assert words[4:8:2] == ['-configuration_directory', '-configuration_basename']
        assert (FOLDER / words[7]).exists()


def test_the_launch_file_of_slam_toolbox_gets_the_parameter_file():
    assert 'slam_params_file:=slam_toolbox.yaml' in PAGE.read_text()
    assert (FOLDER / 'slam_toolbox.yaml').exists()
