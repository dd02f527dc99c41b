"""An emulated servo in virtual time, its loop, and a nod that is tied to an emulated lidar."""

from collections.abc import Callable
from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.control.phase_lock import PhaseLock
from nodlidar_common.arrays import Integers
from nodlidar_common.stamps import NS_PER_S
from nodlidar_servo.device.config import ServoConfig
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.following import Following
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.servo_loop import LoopFigures, ServoLoop
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.nod_motion import ServoShaft
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo.physical_servo import PhysicalServo
import numpy as np

from bench.shared.reference import REFERENCE_N_S, SPAN, START_NS

SETTLING = 2.0  # from rest to the nod
LIDAR_PPM = 200.0
TRUE_BEAM_NS = 1e8 / 1024 / (1.0 + LIDAR_PPM * 1e-6)
STAMP_JITTER = 0.001  # width of the scatter [s]
LATENCY_TIMER = 0.016  # of an adapter as it is sold: 62 Hz
SHORT_LATENCY_TIMER = 0.001  # of one that is set up: 100 Hz
STEP = 2.0 * math.pi / 1024
URG = ScanGeometry(682, -340 * STEP, STEP, 0.1 / 1024, 0.02, 5.6)


@dataclass(frozen=True, slots=True)
class Faults:
    """Of a servo: lateness of its reversals [s], acceleration [rad/s^2], speed over commanded."""

    jitter: float = 0.001
    acceleration: float = 150.0
    speed: float = 0.98


LOADED = Faults()


class LoadedMotion(IdealServo):
    """A servo that its load makes slower than commanded."""

    def __init__(self, faults: Faults, seed: int) -> None:
        super().__init__(0.2, faults.acceleration, faults.jitter, seed, history=1e6)
        self._share = faults.speed

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Go to a goal [rad] at the share of a speed [rad/s] that the load leaves."""
        super().set_goal(now_ns, goal, speed_limit * self._share)


class Rig:
    """An emulated servo, loaded or by physics, and its loop in virtual time."""

    def __init__(
        self,
        servo: Faults | ServoParameters,
        seed: int,
        latency_timer: float = LATENCY_TIMER,
    ) -> None:
        self.motion: ServoShaft = (
            LoadedMotion(servo, seed)
            if isinstance(servo, Faults)
            else PhysicalServo(servo, 0.2, seed, history=1e6)
        )
        self.clock = VirtualClock(START_NS)
        emulator = RxServoEmulator(self.motion, baud=1, latency_timer=latency_timer)
        port = VirtualPort(emulator, self.clock)
        self.commands = NodCommands(ServoConfig())
        self.servo = Servo(port, ServoConfig(), self.clock)
        self.servo.connect()
        self.following = Following(ServoConfig())
        self.loop = ServoLoop(
            self.servo,
            self.commands,
            self.following,
            100.0,
            LoopFigures(),
            self.clock,
            self._sleep,
        )

    def _sleep(self, duration_ns: int) -> None:
        self.clock.advance_to(self.clock() + duration_ns)

    def run(self, cycle: Callable[[], object], end_ns: int) -> None:
        """Repeat a cycle until a time [ns]."""
        while self.clock() < end_ns:
            cycle()

    def reversals_ns(self) -> Integers:
        """Return the instants of all reversals so far [ns], after SETTLING."""
        finder = ReversalFinder()
        times = np.arange(START_NS, self.clock(), NS_PER_S // 1000)
        found = map(finder.add, times.tolist(), self.motion.shaft_position(times).tolist())
        reversals = np.array([each for each in found if each is not None], dtype=np.int64)
        return reversals[reversals > START_NS + round(SETTLING * NS_PER_S)]

    def middles_ns(self) -> Integers:
        """Return the instants at which the shaft was level, after SETTLING [ns]."""
        begin_ns = START_NS + round(SETTLING * NS_PER_S)
        times = np.arange(begin_ns, self.clock(), NS_PER_S // 1000)
        pitch = self.motion.shaft_position(times)
        before = np.flatnonzero(np.signbit(pitch[:-1]) != np.signbit(pitch[1:]))
        share = pitch[before] / (pitch[before] - pitch[before + 1])
        after = np.rint(share * np.diff(times)[before]).astype(np.int64)
        middles: Integers = times[before] + after
        return middles


class Tied:
    """Scans of the lidar, the nod that is tied to them, and the servo that follows it."""

    def __init__(self, rig: Rig, seed: int, samples_per_sweep: int = REFERENCE_N_S) -> None:
        self.nod = PhaseLock(NodShape(-SPAN / 2, SPAN / 2, samples_per_sweep), 1024)
        self._rig = rig
        self._rng = np.random.default_rng(seed)
        self._revolution = 0

    def cycle(self) -> list[Sample]:
        """Do one cycle of the servo, after the scan and the command that are due.

        Return its joint samples.
        """
        due_ns = START_NS + round(self._revolution * 1024 * TRUE_BEAM_NS)
        if self._rig.clock() >= due_ns:
            self._scan(due_ns)
        return self._rig.loop.cycle()

    def _scan(self, due_ns: int) -> None:
        jitter = self._rng.uniform(-0.5, 0.5) * STAMP_JITTER
        self.nod.add_scan(URG, due_ns + round(jitter * NS_PER_S))
        self._revolution += 1
        if self._revolution % 2:
            self.command()

    def command(self) -> None:
        """Send the present command to the servo."""
        if self.nod.nod is not None:
            self._rig.commands.accept(self.nod.nod, self._rig.clock())
