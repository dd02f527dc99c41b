from pathlib import Path
import subprocess
import sys

import nodlidar_servo
import pytest

MODULES = sorted(
    path.stem for path in Path(nodlidar_servo.__file__).parent.glob('*.py') if path.stem != 'node'
)
ROS = ['rclpy', 'sensor_msgs', 'diagnostic_msgs', 'diagnostic_updater', 'nodlidar_msgs']


@pytest.mark.parametrize('module', MODULES)
def test_imports_without_ros(module):
    code = f'import sys; sys.modules.update(dict.fromkeys({ROS})); import nodlidar_servo.{module}'
    subprocess.run([sys.executable, '-c', code], check=True)
