"""Judgements as a table: the worst of each kind of fault."""

from collections.abc import Sequence
import math

from bench.faults.fault_judgement import Judgement
from bench.shared.report import Row

NAMED_WITHIN, HEALED_WITHIN = 1.0, 3.0  # [s]


def row(name: str, judgements: Sequence[Judgement]) -> Row:
    """Return how often a kind of fault was named and healed in time, and the worst figures."""
    named = [j.named for j in judgements if not math.isnan(j.named)]
    healed = [j.healed for j in judgements if not math.isnan(j.healed)]
    return {
        'fault': name,
        'number': len(judgements),
        f'named in {NAMED_WITHIN:g} s': _share(named, NAMED_WITHIN),
        'named [s]': _most(named),
        f'healed in {HEALED_WITHIN:g} s': _share(healed, HEALED_WITHIN),
        'healed [s]': _most(healed),
        'cloud [mm]': _most([j.cloud * 1e3 for j in judgements]),
        'clouds off': sum(j.clouds_off for j in judgements),
        'scan stamp [ms]': _most([j.stamp * 1e3 for j in judgements]),
        'stamps off': sum(j.stamps_off for j in judgements),
        'beams changed': sum(j.changed for j in judgements),
        'clouds missing': sum(j.missing for j in judgements),
        'unaccounted': sum(j.unaccounted for j in judgements),
        'torque off [s]': _most([j.torque_off for j in judgements]),
        'laser off [s]': _most([j.laser_off for j in judgements]),
        'named as': _commonest([j.text for j in judgements if j.text]),
    }


def _commonest(texts: Sequence[str]) -> str:
    return max(texts, key=texts.count, default='')


def _share(times: Sequence[float], limit: float) -> str:
    return f'{sum(t <= limit for t in times)} of {len(times)}' if times else ''


def _most(values: Sequence[float]) -> float | None:
    return max((value for value in values if not math.isnan(value)), default=None)
