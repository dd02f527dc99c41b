"""How long the servo takes to be on a nod of other limits and another N_s, with all its faults."""

from nodlidar_assembler.nod_clock import NodShape
from nodlidar_common.nod import NS_PER_S
import numpy as np
from rich.table import Table

from bench.phase_lock import LATENCY_TIMER, LOADED, Rig, Tied
from bench.reference import SAMPLES_PER_SWEEP, SPAN, START_NS

CHANGES = 25
AFTER_NS = 3 * NS_PER_S  # that the nod is watched for
SPEED = np.pi


def table() -> Table:
    """Return the times until changes are complete."""
    times, beyond_sweep = np.transpose([change(seed) for seed in range(CHANGES)])
    result = Table(
        title=f'{CHANGES} changes to random limits at the same speed, in mid-sweep: time until '
        'the servo is on the new nod, as near as its turns let it'
    )
    for heading in ('median', 'longest', 'longest beyond one sweep'):
        result.add_column(heading, justify='right')
    result.add_row(*(f'{t:.2f} s' for t in (np.median(times), times.max(), beyond_sweep.max())))
    return result


def change(seed: int) -> tuple[float, float]:
    """Return the time [s] that a change takes, and that less a sweep, 0 if it is none."""
    rng, rig = np.random.default_rng(seed), Rig(LOADED, seed)
    tied = Tied(rig, seed)
    _run(rig, tied, START_NS + round(rng.uniform(6.0, 8.0) * NS_PER_S))
    low, high = rng.uniform(-0.8, -0.1), rng.uniform(0.1, 0.8)
    tied.nod.change(NodShape(low, high, round(SAMPLES_PER_SWEEP * (high - low) / SPAN) | 1))
    tied.command()
    begin_ns = rig.clock()
    _run(rig, tied, begin_ns + AFTER_NS)
    nod = tied.nod.nod
    assert nod is not None
    times = np.arange(begin_ns, begin_ns + AFTER_NS, NS_PER_S // 1000)
    error = np.abs(rig.motion.position(times) - nod.pitch(times))
    # Rounding off a turn, and a turn that is late by half of the adapter's time.
    inevitable = SPEED**2 / LOADED.acceleration + SPEED * LATENCY_TIMER / 2.0
    wrong = np.flatnonzero(error > inevitable)
    taken = (wrong[-1] + 1) * 1e-3 if len(wrong) else 0.0
    return taken, max(taken - nod.sweep_duration, 0.0)


def _run(rig: Rig, tied: Tied, end_ns: int) -> None:
    while rig.clock() < end_ns:
        tied.cycle()
