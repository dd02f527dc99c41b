from pathlib import Path
import subprocess
import sys

import pytest

BLOCK = """
import sys
for name in ('rclpy', 'builtin_interfaces', 'sensor_msgs', 'diagnostic_msgs', 'nodlidar_msgs'):
    sys.modules[name] = None
"""
PACKAGE = Path(__file__).parents[1] / 'nodlidar_driver'
WITH_ROS = {'node', 'messages'}


@pytest.mark.parametrize('module', sorted({p.stem for p in PACKAGE.glob('*.py')} - WITH_ROS))
def test_import_without_ros(module):
    command = [sys.executable, '-c', f'{BLOCK}import nodlidar_driver.{module}']
    subprocess.run(command, check=True)
