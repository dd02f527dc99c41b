"""The section `servo` of a scene, and the sets of parameters in `servos/`."""

from nodlidar_sim.world.device_section import DeviceSection
from nodlidar_sim.world.servo.parameters import ServoParameters

_SECTION = DeviceSection('servo', ServoParameters)

servo_names = _SECTION.names
servo_parameters = _SECTION.read
load_servo = _SECTION.load
