import subprocess
import sys

import pytest

BLOCK = """
import sys
for name in ('rclpy', 'builtin_interfaces', 'rcl_interfaces', 'nodlidar_msgs'):
    sys.modules[name] = None
"""
MODULES = [
    'base',
    'effects',
    'motion',
    'pose',
    'raycast',
    'scene',
    'section',
    'sensor_model',
    'servo_motion',
    'shapes',
    'simulation',
    'world',
]


@pytest.mark.parametrize('module', MODULES)
def test_import_without_ros(module):
    command = [sys.executable, '-c', f'{BLOCK}import nodlidar_sim.{module}']
    subprocess.run(command, check=True)
