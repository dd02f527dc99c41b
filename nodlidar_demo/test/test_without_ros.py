"""The algorithms are plain Python: each module imports without ROS but those in ros/."""

from importlib.util import find_spec
from pathlib import Path
import subprocess
import sys

PACKAGES = [
    *('nodlidar_common', 'nodlidar_driver', 'nodlidar_servo', 'nodlidar_planner'),
    *('nodlidar_assembler', 'nodlidar_sim', 'nodlidar_demo', 'nodlidar_bringup'),
    *('nodlidar_mapper', 'nodlidar_viewer'),
]
ROS = [
    *('ament_index_python', 'launch', 'launch_ros', 'rclpy', 'rosidl_runtime_py'),
    *('diagnostic_updater', 'message_filters', 'sensor_msgs_py', 'tf2_ros'),
    *('builtin_interfaces', 'rcl_interfaces'),
    *('diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs', 'nav_msgs', 'nodlidar_msgs'),
    *('sensor_msgs', 'std_msgs', 'tf2_msgs', 'visualization_msgs'),
]
IMPORT_ALL = f"""
import importlib, sys
sys.modules.update(dict.fromkeys({ROS}))
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except ImportError as error:
        print(f'{{name}}: {{error}}')
"""


def modules(package):
    """Return the names of a package's modules."""
    [folder] = find_spec(package).submodule_search_locations
    paths = [path.relative_to(folder) for path in Path(folder).rglob('*.py')]
    inner = ('.'.join(path.with_suffix('').parts) for path in paths if path.stem != '__init__')
    return {f'{package}.{name}' for name in inner}


def not_importable(names):
    """Import modules in an interpreter without ROS; return the names of those that fail."""
    command = [sys.executable, '-c', IMPORT_ALL, *names]
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return {line.split(':')[0] for line in output.splitlines()}


def test_just_the_modules_in_folders_named_ros_need_ros():
    names = set().union(*map(modules, PACKAGES))
    assert not_importable(sorted(names)) == {name for name in names if 'ros' in name.split('.')}
