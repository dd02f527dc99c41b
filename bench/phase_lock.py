"""How well the nod keeps its phase to the lidar: the servo with all its faults, for two minutes.

In virtual time: the servo at byte level, read 62 times a second, with its tick, its speed register
and an adapter that holds replies back. It reverses late, and is weaker and slower than commanded.
The stamps of the scans jitter, and the lidar's clock is off. Reversals are those of the true
motion.
"""

from collections.abc import Callable
from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.reversals import ReversalFinder
from nodlidar_assembler.control.nod_clock import NodClock, NodShape
from nodlidar_common.nod import NS_PER_S
from nodlidar_servo.config import ServoConfig
from nodlidar_servo.following import Following
from nodlidar_servo.nod_commands import NodCommands
from nodlidar_servo.sample import Sample
from nodlidar_servo.servo import Servo
from nodlidar_servo.servo_loop import LoopFigures, ServoLoop
from nodlidar_sim.devices.rx24f import Rx24fEmulator
from nodlidar_sim.devices.rx24f_motor import TICK
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
from nodlidar_sim.world.servo_motion import ServoMotion
import numpy as np
from numpy.typing import NDArray

from bench.reference import SAMPLES_PER_SWEEP, SPAN, START_NS
from bench.report import Row

DURATION = 120.0
SETTLING = 2.0  # from rest to the nod
LIDAR_PPM = 200.0
TRUE_BEAM_NS = 1e8 / 1024 / (1.0 + LIDAR_PPM * 1e-6)
STAMP_JITTER = 0.001  # width of the scatter [s]
LATENCY_TIMER = 0.016
STEP = 2.0 * math.pi / 1024
URG = ScanGeometry(682, -340 * STEP, STEP, 0.1 / 1024, 0.02, 5.6)
NOMINAL_SPEED = SPAN / (SAMPLES_PER_SWEEP * 0.1 / 1024)


@dataclass(frozen=True, slots=True)
class Faults:
    """Of a servo: lateness of its reversals [s], acceleration [rad/s^2], speed over commanded."""

    jitter: float = 0.001
    acceleration: float = 150.0
    speed: float = 0.98


LOADED = Faults()


class LoadedMotion(ServoMotion):
    """A servo that its load makes slower than commanded."""

    def __init__(self, faults: Faults, seed: int) -> None:
        super().__init__(0.2, faults.acceleration, faults.jitter, seed, history=1e6)
        self._share = faults.speed

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Go to a goal [rad] at the share of a speed [rad/s] that the load leaves."""
        super().set_goal(now_ns, goal, speed_limit * self._share)


class Rig:
    """An emulated servo and its loop in virtual time."""

    def __init__(self, faults: Faults, seed: int) -> None:
        self.motion = LoadedMotion(faults, seed)
        self.clock = VirtualClock(START_NS)
        emulator = Rx24fEmulator(self.motion, baud=1, latency_timer=LATENCY_TIMER)
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

    def reversals_ns(self) -> NDArray[np.int64]:
        """Return the instants of all reversals so far [ns], after SETTLING."""
        finder = ReversalFinder()
        times = np.arange(START_NS, self.clock(), NS_PER_S // 1000)
        found = map(finder.add, times.tolist(), self.motion.position(times).tolist())
        reversals = np.array([each for each in found if each is not None], dtype=np.int64)
        return reversals[reversals > START_NS + round(SETTLING * NS_PER_S)]


class Tied:
    """Scans of the lidar, the nod that is tied to them, and the servo that follows it."""

    def __init__(self, rig: Rig, seed: int) -> None:
        self.nod = NodClock(NodShape(-SPAN / 2, SPAN / 2, SAMPLES_PER_SWEEP), 1024)
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


def locked(rig: Rig) -> Callable[[], object]:
    """Return a cycle of the servo that follows a nod tied to the lidar."""
    return Tied(rig, seed=1).cycle


def by_speed_commands(rig: Rig) -> Callable[[], object]:
    """Return a cycle at the nominal speed that reverses about where the limit is measured."""
    goal = SPAN / 2

    def cycle() -> None:
        nonlocal goal
        sample = rig.servo.read()
        if (goal - sample.pitch) * math.copysign(1.0, goal) <= 1.5 * TICK:
            goal = -goal
        rig.servo.drive(goal, NOMINAL_SPEED)

    return cycle


NODS = {'phase locked': locked, 'speed commands only': by_speed_commands}
TITLE = (
    f'Phase of the nod to the lidar, {DURATION:.0f} s at N_s = {SAMPLES_PER_SWEEP}, '
    f'62 Hz, lidar {LIDAR_PPM:.0f} ppm off'
)


def results() -> list[Row]:
    """Return measured N_s and phase errors, locked and with speed commands only."""
    rows = []
    for name, cycle_of in NODS.items():
        rig = Rig(LOADED, seed=1)
        rig.run(cycle_of(rig), START_NS + round((SETTLING + DURATION) * NS_PER_S))
        rows.append({'nod': name, 'servo': 'late, loaded', **_figures(rig.reversals_ns())})
    return rows


def _figures(reversals_ns: NDArray[np.int64]) -> Row:
    """Return N_s as the slope of a line through the reversals, and errors of the phase."""
    beams = (reversals_ns - START_NS) / TRUE_BEAM_NS
    number = np.arange(len(beams))
    first = round((beams[0] + 0.5) / SAMPLES_PER_SWEEP)
    error = beams + 0.5 - (first + number) * SAMPLES_PER_SWEEP
    error = error * TRUE_BEAM_NS / NS_PER_S
    early, late = reversals_ns - reversals_ns[0] < 60e9, reversals_ns[-1] - reversals_ns < 60e9
    slope = float(np.polyfit(number, beams, 1)[0])
    return {
        f'measured N_s, less {SAMPLES_PER_SWEEP}': slope - SAMPLES_PER_SWEEP,
        'phase error RMS, first minute [ms]': math.sqrt(float(np.mean(error[early] ** 2))) * 1e3,
        'last minute [ms]': math.sqrt(float(np.mean(error[late] ** 2))) * 1e3,
        'mean [ms]': float(error[late].mean()) * 1e3,
    }
