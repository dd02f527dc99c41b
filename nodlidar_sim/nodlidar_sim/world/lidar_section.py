"""The section `lidar` of a scene, and the sets of parameters in `lidars/`."""

from nodlidar_sim.world.device_section import DeviceSection
from nodlidar_sim.world.lidar_parameters import LidarParameters

_SECTION = DeviceSection('lidar', LidarParameters)

lidar_parameters = _SECTION.read
load_lidar = _SECTION.load
