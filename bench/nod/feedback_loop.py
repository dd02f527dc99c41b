"""Each mode of the nod with the loop closed: scans, the node's choice, its command, the servo.

In virtual time, with the servo at byte level: one that is late at reversals, and servos by
physics. Every beam has the pitch of the true motion. Coverage is counted alike for all modes.
"""

from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_MOUNT
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.chosen_sweeps import ChosenSweeps
from nodlidar_assembler.control.nod_config import NOD_MODES
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_sim.world.servo.parameters import ServoParameters
from nodlidar_sim.world.servo_section import load_servo
import numpy as np

from bench.nod.servo_rig import Faults, Rig, TRUE_BEAM_NS, URG
from bench.shared.reference import START_NS
from bench.shared.report import Row

TITLE = 'Rounds of coverage with the emulated servo, 10 cm at 2 m in what the URG-04LX sees'
DURATION = 120.0
SETTLED = 50  # scans until the servo is on the nod
SEEDS = range(1)
SERVOS: dict[str, Faults | ServoParameters] = {
    'late by 3 ms': Faults(0.003),  # by |N(0, 3 ms)| at each reversal
    'RX-24F': load_servo('rx24f'),
    'MX-28': load_servo('mx28'),
}
DEFAULT = AssemblerConfig().samples_per_sweep
MODES = (
    *((mode, n_s) for n_s in (2501, 4001, DEFAULT) for mode in NOD_MODES),
    ('coprime', 39101),
    ('interlaced', 40001),
)
DELAY_NS = 30_000_000  # from a scan's last beam until its cloud is assembled
BEAMS = Beams(URG, REFERENCE_MOUNT)


def results() -> list[Row]:
    """Return the times of the rounds of coverage; infinite if there was none."""
    return [_row(*mode) for mode in MODES]


def _row(mode: str, n_s: int) -> Row:
    row: Row = {'nod_mode': mode, 'N_s': n_s}
    for name, servo in SERVOS.items():
        taken = [time for seed in SEEDS for time in rounds(mode, n_s, servo, seed)]
        row[f'{name}: median [s]'] = float(np.median(taken or [np.inf]))
        row[f'{name}: longest [s]'] = max(taken, default=np.inf)
    return row


def rounds(mode: str, n_s: int, servo: Faults | ServoParameters, seed: int) -> list[float]:
    """Return how long each round of coverage took [s], with one mode of the nod."""
    config = AssemblerConfig(nod_mode=mode, samples_per_sweep=n_s)
    rig = Rig(servo, seed)
    controller, taken = NodController(config), {}
    seen: ChosenSweeps | None = None
    for revolution in range(round(DURATION * 10)):
        begin_ns = START_NS + round(revolution * 1024 * TRUE_BEAM_NS)
        times_ns = begin_ns + BEAMS.offset_ns
        rig.run(rig.loop.cycle, int(times_ns[-1]) + DELAY_NS)
        controller.add_scan(URG, begin_ns)
        pitch = rig.motion.position(times_ns)
        controller.add_beams(begin_ns, BEAMS, pitch, rig.clock())
        assert controller.command is not None
        nod, start_ns = controller.command
        rig.commands.accept(nod, rig.clock(), start_ns)
        if revolution >= SETTLED:
            seen = seen or ChosenSweeps(config.task, nod, config.timing_error, 1)
            seen.add_beams(times_ns, BEAMS.azimuth, pitch)
            taken[seen.rounds] = seen.round_time
    # The first round began during one of the controller's.
    return [time for number, time in taken.items() if number > 1]
