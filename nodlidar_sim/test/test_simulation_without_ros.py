import pkgutil
import subprocess
import sys

import nodlidar_sim
import pytest

BLOCK = """
import sys
for name in ('rclpy', 'builtin_interfaces', 'rcl_interfaces', 'nodlidar_msgs'):
    sys.modules[name] = None
"""
MODULES = [module.name for module in pkgutil.iter_modules(nodlidar_sim.__path__)]


@pytest.mark.parametrize('module', MODULES)
def test_import_without_ros(module):
    command = [sys.executable, '-c', f'{BLOCK}import nodlidar_sim.{module}']
    subprocess.run(command, check=True)
