import subprocess
import sys

import pytest

BLOCK = """
import sys
for name in ('rclpy', 'builtin_interfaces', 'rcl_interfaces', 'nodlidar_msgs'):
    sys.modules[name] = None
"""


@pytest.mark.parametrize('module', ['errors', 'nod', 'parameters', 'scip', 'serial_port'])
def test_import_without_ros(module):
    command = [sys.executable, '-c', f'{BLOCK}import nodlidar_common.{module}']
    subprocess.run(command, check=True)
