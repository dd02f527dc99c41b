"""How long the scan of a region takes with a servo by physics, over the time that is predicted.

In virtual time: the servo at byte level, its joint states, the assembly, the node's choice and its
commands. Regions, objects and the instants of the goals are random.
"""

from nodlidar_assembler.clouds.pipeline import Assembled, Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_assembler.control.region_plan import Region, region_plan
from nodlidar_assembler.control.region_scan import RegionScan
from nodlidar_assembler.scan_assembler import ScanAssembler
from nodlidar_common.stamps import NS_PER_S
from nodlidar_servo.device.config import ServoConfig
from nodlidar_sim.world.device_section import load_servo
import numpy as np

from bench.nod.servo_rig import LATENCY_TIMER, Rig, SHORT_LATENCY_TIMER, TRUE_BEAM_NS, URG
from bench.shared.reference import START_NS
from bench.shared.report import Row

GOALS = 20
TITLE = f'Scans of {GOALS} random regions: time taken over time predicted, servos by physics'
SERVOS = {
    ('rx24f', 100): SHORT_LATENCY_TIMER,
    ('rx24f', 62): LATENCY_TIMER,
    ('mx28', 100): SHORT_LATENCY_TIMER,
    ('xl430', 100): SHORT_LATENCY_TIMER,
}
FIRST_NS = 6 * NS_PER_S  # the servo is on the nod
SCAN_NS = round((URG.beams - 1) * TRUE_BEAM_NS) + 5_000_000  # from its first beam to its arrival
WITHIN = 0.1


def results() -> list[Row]:
    """Return how the times taken compare with those predicted."""
    return [_row(*servo) for servo in SERVOS]


def _row(servo: str, rate: int) -> Row:
    taken = np.array([scanned(servo, rate, seed) for seed in range(GOALS)])
    ratio = taken[:, 0] / taken[:, 1]
    return {
        'servo': servo,
        'joint states [Hz]': rate,
        'median predicted [s]': float(np.median(taken[:, 1])),
        'taken / predicted, median': float(np.median(ratio)),
        'least': float(ratio.min()),
        'largest': float(ratio.max()),
        f'within {WITHIN:.0%} [share]': float(np.mean(np.abs(ratio - 1.0) <= WITHIN)),
        'all seen [share]': float(np.mean(taken[:, 2])),
    }


def region_of(rng: np.random.Generator) -> Region:
    """Return a random region of at least 0.1 by 0.2 rad, and an object of at least two steps."""
    low, high = np.sort(rng.uniform(-0.78, 0.78, 2))
    right, left = np.sort(rng.uniform(-2.08, 2.08, 2))
    distance = rng.uniform(0.5, 5.0)
    size = rng.uniform(0.05, 0.3)
    if high - low < 0.1 or left - right < 0.2 or not 0.0123 < size / distance < 0.5:
        return region_of(rng)
    return Region(low, high, right, left, size, distance)


class Sensor:
    """Servo, lidar, assembly and the node's choice of the nod, in virtual time."""

    def __init__(self, servo: str, rate: int, seed: int) -> None:
        self.rig = Rig(load_servo(servo), seed, SERVOS[servo, rate])
        self._config = AssemblerConfig()
        self._assembler, self._controller = (
            ScanAssembler(self._config),
            NodController(self._config),
        )
        self._sent_ns = self._revolution = 0

    def cycle(self) -> None:
        """Do one cycle of the servo, then what scan and nod command are due."""
        for sample in self.rig.loop.cycle():
            self._assembler.add_joint_sample(sample.stamp_ns, sample.pitch)
        begin_ns = START_NS + round(self._revolution * 1024 * TRUE_BEAM_NS)
        if self.rig.clock() >= begin_ns + SCAN_NS:
            self._scan(begin_ns)
        if self.rig.clock() - self._sent_ns > NS_PER_S / self._config.command_rate:
            self._command()

    def assembled(self) -> list[Assembled]:
        """Return the scans that are assembled by now."""
        outcomes = self._assembler.ready(self.rig.clock())
        return [each.assembled for each in outcomes if each.assembled is not None]

    def begin(self, region: Region) -> RegionScan:
        """Take the nod over for a region."""
        now_ns, view = self.rig.clock(), self._controller.view
        limits = ServoConfig().pitch_lower_limit, ServoConfig().pitch_upper_limit
        plan = region_plan(region, view.config, view.task, limits)
        scan = RegionScan(plan, now_ns, self._controller.take_over(plan.shape, now_ns))
        self._command()
        return scan

    def _scan(self, begin_ns: int) -> None:
        self._revolution += 1
        approaching = self._controller.approaching
        self._controller.add_scan(URG, begin_ns)
        # Of two ranges in turns, as no two scans of a real lidar are equal.
        ranges = np.full(URG.beams, 2.0 + 0.001 * (self._revolution % 2), dtype=np.float32)
        self._assembler.add_scan(Scan(begin_ns, URG, ranges), self.rig.clock())
        if approaching:
            self._command()

    def _command(self) -> None:
        if self._controller.command is not None:
            nod, start_ns = self._controller.command
            self.rig.commands.accept(nod, self.rig.clock(), start_ns)
            self._sent_ns = self.rig.clock()


def scanned(servo: str, rate: int, seed: int) -> tuple[float, float, bool]:
    """Return the time taken and the time predicted [s], and whether every cell was seen."""
    rng = np.random.default_rng(seed)
    region, goal_ns = region_of(rng), START_NS + FIRST_NS + round(rng.uniform(0, 2e9))
    sensor = Sensor(servo, rate, seed)
    going: RegionScan | None = None
    while going is None or not going.is_over:
        sensor.cycle()
        now_ns = sensor.rig.clock()
        if going is None and now_ns >= goal_ns:
            going = sensor.begin(region)
        for assembled in sensor.assembled():
            if going is not None:
                going.add(assembled)
        if going is not None:
            going.check(now_ns)
    return going.duration, going.predicted_time, going.success
