"""A servo in virtual time, seen from both sides: by the bus and in its registers."""

from nodlidar_servo.device.servo import Servo
from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.ideal_servo import IdealServo
import numpy as np

START_NS = 1_800_000_000_000_000_000


class ServoBench:
    """An emulated servo of a kind at a pitch, on a port whose faults can be set."""

    def __init__(self, emulator, config, pitch=0.2, **options):
        self.motion = IdealServo(pitch)
        self.emulator = emulator(self.motion, **options)
        self.faults = FaultyDevice(self.emulator)
        self.clock = VirtualClock(START_NS)
        self.port = VirtualPort(self.faults, self.clock)
        self.config = config

    def connect(self, config=None):
        servo = Servo(self.port, config or self.config, self.clock)
        servo.connect()
        return servo

    def __getitem__(self, register):
        return self.emulator.table[register]

    def __setitem__(self, register, value):
        self.emulator.table[register] = value

    def pitch(self, time_ns):
        return float(self.motion.position(np.array([time_ns]))[0])

    def pass_time(self, seconds):
        self.clock.advance_to(self.clock() + round(seconds * 1e9))
