"""Commands on a machine that lacks a Python package: a line that says which, and how to get it."""

import subprocess
import sys

import pytest

WITHOUT = """
import importlib, sys
package, command, missing = sys.argv[1:]
sys.modules[missing] = None
entry_points = importlib.import_module(package + '.commands.entry_points')
sys.exit(getattr(entry_points, command)(['a.mcap', 'b.ply'] if 'bag' in command else []))
"""


@pytest.mark.parametrize(
    ('package', 'command', 'missing'),
    [
        ('nodlidar_assembler', 'assemble_bag', 'rosbags'),
        ('nodlidar_assembler', 'calibrate', 'numpy'),
        ('nodlidar_assembler', 'calibrate', 'transforms3d'),
        ('nodlidar_planner', 'plan_scan', 'rich'),
        ('nodlidar_demo', 'demo', 'rosbags'),
        ('nodlidar_mapper', 'map_bag', 'matplotlib'),
        ('nodlidar_driver', 'probe', 'numpy'),
        ('nodlidar_servo', 'setup', 'numpy'),
    ],
)
def test_the_package_is_named_with_the_way_to_get_it(package, command, missing):
    run = [sys.executable, '-c', WITHOUT, package, command, missing]
    process = subprocess.run(run, capture_output=True, text=True)
    said = f'{command}: error: needs the Python package {missing}: pip install {missing}'
    assert process.stderr.startswith(said)
    assert (process.returncode, process.stdout, process.stderr.count('\n')) == (1, '', 1)


def test_launch_files_need_no_package_from_pypi():
    """They run in the Python of the system, even where the nodes have an environment of theirs."""
    missing = ('dynamixel_sdk', 'plyfile', 'rich', 'rosbags', 'viser')
    code = f'import sys; sys.modules.update(dict.fromkeys({missing!r}))\n'
    code += 'import nodlidar_bringup.ros.recorded_sensor, nodlidar_bringup.ros.sensor'
    process = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
