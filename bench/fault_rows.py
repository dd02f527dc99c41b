"""Judgements as a table: the worst of each kind of fault."""

from collections.abc import Sequence
import math

from bench.fault_judgement import Judgement
from bench.fault_rig import Load
from bench.report import Row

NAMED_WITHIN, HEALED_WITHIN = 1.0, 3.0  # [s]
_WARM_NS = 10_000_000_000  # after its start a process has all that it needs
FAULT = 'fault'


def row(name: str, judgements: Sequence[Judgement]) -> Row:
    """Return how often a kind of fault was named and healed in time, and the worst of the rest."""
    named = [j.named for j in judgements if not math.isnan(j.named)]
    counted = [j.counted for j in judgements if not math.isnan(j.counted)]
    healed = [j.healed for j in judgements if not math.isnan(j.healed)]
    told = [j.text for j in judgements if j.text]
    return {
        FAULT: name,
        'number': len(judgements),
        f'named in {NAMED_WITHIN:g} s': _share(named, NAMED_WITHIN),
        'named [s]': _most(named),
        f'counted in {NAMED_WITHIN:g} s': _share(counted, NAMED_WITHIN),
        f'healed in {HEALED_WITHIN:g} s': _share(healed, HEALED_WITHIN),
        'healed [s]': _most(healed),
        'cloud [mm]': _most([j.cloud * 1e3 for j in judgements]),
        'clouds off': sum(j.clouds_off for j in judgements),
        'scan stamp [ms]': _most([j.stamp * 1e3 for j in judgements]),
        'stamps off': sum(j.stamps_off for j in judgements),
        'pitch [mrad]': _most([j.joint * 1e3 for j in judgements]),
        'beams changed': sum(j.changed for j in judgements),
        'clouds missing': sum(j.missing for j in judgements),
        'unaccounted': sum(j.unaccounted for j in judgements),
        'torque off [s]': _most([j.torque_off for j in judgements]),
        'laser off [s]': _most([j.laser_off for j in judgements]),
        'named as': _commonest(told),
    }


def load_rows(loads: Sequence[Load]) -> list[Row]:
    """Return the memory and the open files of each node's process that ran longest."""
    rows = []
    for node in dict.fromkeys(load.node for load in loads):
        runs: dict[int, list[Load]] = {}
        for load in loads:
            if load.node == node:
                runs.setdefault(load.pid, []).append(load)
        run = max(runs.values(), key=lambda each: each[-1].time_ns - each[0].time_ns)
        run = [each for each in run if each.time_ns >= run[0].time_ns + _WARM_NS] or run
        minutes = (run[-1].time_ns - run[0].time_ns) / 60e9
        rows.append(
            {
                FAULT: f'all, node {node}',
                'over [min]': minutes,
                'memory [MB]': f'{run[0].memory:.1f} to {run[-1].memory:.1f}',
                'open files': f'{run[0].files} to {run[-1].files}',
            }
        )
    return rows


def _commonest(texts: Sequence[str]) -> str:
    return max(texts, key=texts.count, default='')


def _share(times: Sequence[float], limit: float) -> str:
    return f'{sum(t <= limit for t in times)} of {len(times)}' if times else ''


def _most(values: Sequence[float]) -> float | None:
    return max((value for value in values if not math.isnan(value)), default=None)
