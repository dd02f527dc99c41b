"""How well the nod keeps its phase to the lidar: the servo with all its faults, for two minutes.

In virtual time: the servo at byte level, read 62 times a second, with its tick, its speed register
and an adapter that keeps replies, late in turning, weaker and slower than it is told; scans whose
stamps jitter, from a lidar whose clock is off. Reversals are taken from the true motion.
"""

from collections.abc import Callable
from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.clouds.turns import TurnFinder
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
    """Of a servo: lateness of its turns [s], acceleration [rad/s^2], speed against commanded."""

    jitter: float = 0.0
    acceleration: float = 200.0
    speed: float = 1.0


IDEAL = Faults()
LOADED = Faults(jitter=0.001, acceleration=150.0, speed=0.98)


class LoadedMotion(ServoMotion):
    """A servo that its load makes slower than it is told."""

    def __init__(self, faults: Faults, seed: int) -> None:
        super().__init__(0.2, faults.acceleration, faults.jitter, seed, history=1e6)
        self._share = faults.speed

    def set_goal(self, now_ns: int, goal: float, speed_limit: float) -> None:
        """Go to a goal [rad] at the share of a speed [rad/s] that the load leaves."""
        super().set_goal(now_ns, goal, speed_limit * self._share)


@dataclass(frozen=True, slots=True)
class Kept:
    """What a run came to.

    Attributes
    ----------
    samples_per_sweep
        N_s as measured: the slope of a line through the reversals, in beams of the lidar.
    phase_errors
        RMS in the first and in the last minute [s].
    phase_offset
        Mean of the last minute [s].
    """

    samples_per_sweep: float
    phase_errors: tuple[float, float]
    phase_offset: float


def kept(turns_ns: NDArray[np.int64]) -> Kept:
    """Return what reversals [ns] make of the nod that was wanted."""
    beams = (turns_ns - START_NS) / TRUE_BEAM_NS
    number = np.arange(len(beams))
    first = round((beams[0] + 0.5) / SAMPLES_PER_SWEEP)
    error = beams + 0.5 - (first + number) * SAMPLES_PER_SWEEP
    error = error * TRUE_BEAM_NS / NS_PER_S
    minutes = [(turns_ns - turns_ns[0]) < 60e9, (turns_ns[-1] - turns_ns) < 60e9]
    first_rms, last_rms = (math.sqrt(float(np.mean(error[minute] ** 2))) for minute in minutes)
    slope = float(np.polyfit(number, beams, 1)[0])
    return Kept(slope, (first_rms, last_rms), float(error[minutes[1]].mean()))


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

    def run(self, cycle: Callable[[], object]) -> Kept:
        """Repeat a cycle for the time of the measurement and return what came of it."""
        end_ns = START_NS + round((SETTLING + DURATION) * NS_PER_S)
        while self.clock() < end_ns:
            cycle()
        return kept(self._turns())

    def _turns(self) -> NDArray[np.int64]:
        finder = TurnFinder(0.02)
        times = np.arange(START_NS, self.clock(), NS_PER_S // 1000)
        found = map(finder.add, times.tolist(), self.motion.position(times).tolist())
        turns = np.array([turn for turn in found if turn is not None], dtype=np.int64)
        return turns[turns > START_NS + round(SETTLING * NS_PER_S)]


class Tied:
    """Scans of the lidar, the nod that so many of them tie, and the servo that follows it."""

    def __init__(self, rig: Rig, seed: int, scans: float = math.inf) -> None:
        self.nod = NodClock(NodShape(-SPAN / 2, SPAN / 2, SAMPLES_PER_SWEEP), 1024)
        self._rig, self._scans = rig, scans
        self._rng = np.random.default_rng(seed)
        self._revolution = 0

    def cycle(self) -> list[Sample]:
        """Do one cycle of the servo, after the scan and the command that are due.

        Return what it measured.
        """
        due_ns = START_NS + round(self._revolution * 1024 * TRUE_BEAM_NS)
        if self._rig.clock() >= due_ns:
            self._scan(due_ns)
        return self._rig.loop.cycle()

    def _scan(self, due_ns: int) -> None:
        if self._revolution < self._scans:
            jitter = self._rng.uniform(-0.5, 0.5) * STAMP_JITTER
            self.nod.add_scan(URG, due_ns + round(jitter * NS_PER_S))
        self._revolution += 1
        if self._revolution % 2:
            self.command()

    def command(self) -> None:
        """Give the present command to the servo."""
        if self.nod.nod is not None:
            self._rig.commands.accept(self.nod.nod, self._rig.clock())


def locked(faults: Faults, seed: int = 1, scans: float = math.inf) -> Kept:
    """Return what the servo node and the nod make of it that so many scans have tied."""
    rig = Rig(faults, seed)
    return rig.run(Tied(rig, seed, scans).cycle)


def tied_at_the_start(faults: Faults) -> Kept:
    """Return what a nod makes of it that was tied to the lidar by its first scan only."""
    return locked(faults, scans=1)


def speed_command_only(faults: Faults, seed: int = 1) -> Kept:
    """Return what the nominal speed makes of it, turned about where the limit is measured."""
    rig, goal = Rig(faults, seed), SPAN / 2

    def cycle() -> None:
        nonlocal goal
        sample = rig.servo.read()
        if (goal - sample.pitch) * math.copysign(1.0, goal) <= 1.5 * TICK:
            goal = -goal
        rig.servo.drive(goal, NOMINAL_SPEED)

    return rig.run(cycle)


NODS: dict[str, Callable[[Faults], Kept]] = {
    'phase locked': locked,
    'tied at the start only': tied_at_the_start,
    'speed commands only': speed_command_only,
}


TITLE = (
    f'Phase of the nod to the lidar, {DURATION:.0f} s at N_s = {SAMPLES_PER_SWEEP}, '
    f'62 Hz, lidar {LIDAR_PPM:.0f} ppm off'
)


def results() -> list[Row]:
    """Return measured N_s and phase errors, locked and with speed commands only."""
    return [
        _row(name, servo, run(faults))
        for name, run in NODS.items()
        for servo, faults in (('ideal', IDEAL), ('late, loaded', LOADED))
    ]


def _row(nod: str, servo: str, found: Kept) -> Row:
    first, last = found.phase_errors
    return {
        'nod': nod,
        'servo': servo,
        f'measured N_s, less {SAMPLES_PER_SWEEP}': found.samples_per_sweep - SAMPLES_PER_SWEEP,
        'phase error RMS, first minute [ms]': first * 1e3,
        'last minute [ms]': last * 1e3,
        'mean [ms]': found.phase_offset * 1e3,
    }
