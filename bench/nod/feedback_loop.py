"""Each mode of the nod with the loop closed: scans, the node's choice, its command, the servo.

In virtual time, with the servo at byte level: one that is late at reversals, and servos by
physics. Every beam has the pitch of the true motion. Coverage is counted alike for all modes. A
round that is given up counts, and the last one is measured to its end.
"""

from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.chosen_sweeps import LONGEST_ROUND
from nodlidar_assembler.control.nod_config import NOD_MODES
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.sweeps.feedback import Feedback
from nodlidar_planner.sweeps.schedule import even_rows
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.servo.parameters import ServoParameters
import numpy as np

from bench.nod.servo_rig import Faults, Rig, TRUE_BEAM_NS, URG
from bench.shared.reference import START_NS
from bench.shared.report import Row

TITLE = 'Rounds of coverage with the emulated servo, 10 cm at 2 m in what the URG-04LX sees'
DURATION = 120.0  # until the last round begins
SETTLED = 5.0  # until the servo is on the nod
SEEDS = range(4)
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
BEAMS = Beams(URG, REFERENCE_LASER_POSE)


def results() -> list[Row]:
    """Return the times of the rounds of coverage, and their number, over all seeds.

    Infinite: given up after LONGEST_ROUND, as the node does.
    """
    return [_row(*mode) for mode in MODES]


def _row(mode: str, n_s: int) -> Row:
    row: Row = {'nod_mode': mode, 'N_s': n_s}
    for name, servo in SERVOS.items():
        taken = [time for seed in SEEDS for time in rounds(mode, n_s, servo, seed)]
        # Not interpolated, since times may be infinite.
        row[f'{name}: median [s]'] = float(np.quantile(taken, 0.5, method='higher'))
        row[f'{name}: longest [s]'] = max(taken)
        row[f'{name}: rounds'] = len(taken)
    return row


def rounds(mode: str, n_s: int, servo: Faults | ServoParameters, seed: int) -> list[float]:
    """Return how long each round of coverage took [s], with one mode of the nod; see results."""
    config = AssemblerConfig(nod_mode=mode, samples_per_sweep=n_s)
    rig = Rig(servo, seed)
    controller = NodController(config)
    seen = Feedback(even_rows(config.task), n_s, config.timing_error)
    revolution, taken = 0, list[float]()
    # From the first scan on, as the controller counts: its rounds are the same.
    round_ns = START_NS + int(BEAMS.offset_ns[-1])
    while round_ns < START_NS + DURATION * NS_PER_S:
        begin_ns = START_NS + round(revolution * 1024 * TRUE_BEAM_NS)
        times_ns = begin_ns + BEAMS.offset_ns
        rig.run(rig.loop.cycle, int(times_ns[-1]) + DELAY_NS)
        controller.add_scan(URG, begin_ns)
        pitch = rig.motion.position(times_ns)
        controller.add_beams(begin_ns, BEAMS, pitch, rig.clock())
        assert controller.command is not None
        nod, start_ns = controller.command
        rig.commands.accept(nod, rig.clock(), start_ns)
        seen.saw_beams(BEAMS.azimuth, pitch)
        time = (int(times_ns[-1]) - round_ns) / NS_PER_S
        complete = not seen.unseen.any()
        if complete or time > LONGEST_ROUND:
            if round_ns > START_NS + SETTLED * NS_PER_S or not complete:
                taken.append(time if complete else np.inf)
            seen.forget()
            round_ns = int(times_ns[-1])
        revolution += 1
    return taken
