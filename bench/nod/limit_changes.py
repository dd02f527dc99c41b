"""How long the servo takes to be on a nod of other limits and another N_s, with all its faults.

The time counts from the command until the servo stays on the new nod, as closely as its reversals
permit. A sweep is one of the new nod. If a change comes while the one before it is under way, each
has its own sweep.
"""

from dataclasses import dataclass

from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
import numpy as np

from bench.nod.servo_rig import LATENCY_TIMER, LOADED, Rig, Tied, TRUE_BEAM_NS
from bench.shared.reference import START_NS
from bench.shared.report import Row

CHANGES = 50  # of each kind
AFTER_NS = 3 * NS_PER_S  # after a change, watched
MOUNT = 0.8  # limits lie within plus and minus this [rad]
LEAST_SPAN = 0.3  # rad
SHORTEST_SWEEP = 0.15  # s
SPEEDS = (1.5, 4.2)  # rad/s
KINDS = ('the same speed', 'another speed', 'at a reversal', 'one after the other', 'far away')
TITLE = (
    f'Changes to random limits within {MOUNT} rad, {CHANGES} of each kind: time until the servo '
    'is on the new nod, as closely as its reversals permit'
)


@dataclass(frozen=True, slots=True)
class Change:
    """How long it took, and how much longer than one sweep (negative if shorter) [s]."""

    taken: float
    beyond_sweep: float


def results() -> list[Row]:
    """Return the times until changes are complete."""
    return [_row(kind, [change(seed, kind) for seed in range(CHANGES)]) for kind in KINDS]


def _row(kind: str, changes: list[Change]) -> Row:
    taken = [change.taken for change in changes]
    return {
        'change': kind,
        'median [s]': float(np.median(taken)),
        'longest [s]': max(taken),
        'longest beyond one sweep [s]': max(0.0, *(change.beyond_sweep for change in changes)),
    }


def change(seed: int, kind: str) -> Change:
    """Return how long a change takes that happens at a random time in the reference nod.

    Parameters
    ----------
    seed
        Of limits, times and faults.
    kind
        One of KINDS. The nod is no farther than the new span from the new limits, except with the
        last kind. The speed is another one, except with the first kind. 'at a reversal' is up to
        20 ms before or after one, 'one after the other' within 0.3 s.
    """
    rng, rig = np.random.default_rng(seed), Rig(LOADED, seed)
    tied = Tied(rig, seed)
    rig.run(tied.cycle, START_NS + round(rng.uniform(6.0, 8.0) * NS_PER_S))
    if kind == 'at a reversal':
        number = int(np.ceil(_present(tied).sweeps(rig.clock()))) + 1
        wait_ns = round(rng.uniform(-0.02, 0.02) * NS_PER_S)
        rig.run(tied.cycle, _present(tied).reversal_time_ns(number) + wait_ns)
    left = 0.0
    if kind == 'one after the other':
        _change(rig, tied, rng, kind)
        wait = rng.uniform(0.0, 0.3)
        rig.run(tied.cycle, rig.clock() + round(wait * NS_PER_S))
        left = max(_present(tied).sweep_duration - wait, 0.0)
    begin_ns = rig.clock()
    _change(rig, tied, rng, kind)
    rig.run(tied.cycle, begin_ns + AFTER_NS)
    taken = _settled(rig, _present(tied), begin_ns)
    return Change(taken, taken - left - _present(tied).sweep_duration)


def _settled(rig: Rig, nod: Nod, begin_ns: int) -> float:
    """Return the time [s] after which the servo is always on the nod."""
    times = np.arange(begin_ns, begin_ns + AFTER_NS, NS_PER_S // 1000)
    error = np.abs(rig.motion.position(times) - nod.pitch(times))
    # The rounding of a reversal, and a reversal that is late by half of the adapter's time.
    inevitable = nod.speed**2 / LOADED.acceleration + nod.speed * LATENCY_TIMER / 2.0
    wrong = np.flatnonzero(error > inevitable)
    return float((wrong[-1] + 1) * 1e-3) if len(wrong) else 0.0


def _change(rig: Rig, tied: Tied, rng: np.random.Generator, kind: str) -> None:
    pitch = float(_present(tied).pitch(rig.clock()))
    while True:
        low, high = np.sort(rng.uniform(-MOUNT, MOUNT, 2))
        speed = np.pi if kind == 'the same speed' else rng.uniform(*SPEEDS)
        span, far = high - low, max(pitch - high, low - pitch) > high - low
        if span >= LEAST_SPAN and span / speed >= SHORTEST_SWEEP and far == (kind == 'far away'):
            break
    samples = round(span / speed / TRUE_BEAM_NS * NS_PER_S) | 1
    tied.nod.change(NodShape(low, high, samples), rig.clock())
    tied.command()


def _present(tied: Tied) -> Nod:
    assert tied.nod.nod is not None
    return tied.nod.nod
