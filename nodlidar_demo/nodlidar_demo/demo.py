"""Scans a simulated scene, measures the clouds and draws them: `ros2 run nodlidar_demo demo`."""

from nodlidar_common.command_line import command

main = command('demo', 'nodlidar_demo.ros.demonstration:demonstrate', __doc__)
