"""Each mode of the nod with the loop closed: scans, the node's choice, its command, the servo.

In virtual time, with the servo at byte level and late at reversals; every beam has the pitch of
the true motion. Coverage is counted alike for all modes.
"""

from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_MOUNT
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.chosen_sweeps import ChosenSweeps
from nodlidar_assembler.control.nod_controller import NodController
import numpy as np

from bench.phase_lock import Faults, Rig, TRUE_BEAM_NS, URG
from bench.reference import START_NS
from bench.report import Row

TITLE = 'Rounds of coverage with the emulated servo, 10 cm at 2 m in what the URG-04LX sees'
DURATION = 120.0
SETTLED = 50  # scans until the servo is on the nod
LATENESS = (0.001, 0.003)  # of the servo's reversals: they are late by |N(0, lateness)| [s]
MODES = (
    ('coprime', 2501),
    ('feedback', 2501),
    ('coprime', 4001),
    ('feedback', 4001),
    ('coprime', 13565),
    ('interlaced', 4001),
    ('interlaced', 12001),
    ('interlaced', 40001),
)
DELAY_NS = 30_000_000  # from a scan's last beam until its cloud is assembled
BEAMS = Beams(URG, REFERENCE_MOUNT)


def results() -> list[Row]:
    """Return the times of the rounds of coverage."""
    return [_row(*mode, lateness) for mode in MODES for lateness in LATENESS]


def _row(mode: str, n_s: int, lateness: float) -> Row:
    taken = rounds(mode, n_s, lateness)
    return {
        'nod_mode': mode,
        'N_s': n_s,
        'late by [ms]': lateness * 1e3,
        'median [s]': float(np.median(taken)),
        'longest [s]': max(taken),
    }


def rounds(mode: str, n_s: int, lateness: float) -> list[float]:
    """Return how long each round of coverage took [s], with one mode of the nod."""
    config = AssemblerConfig(nod_mode=mode, samples_per_sweep=n_s)
    rig = Rig(Faults(lateness), seed=1)
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
