"""Fig. 10: where in the nod beams repeat, with reversals of finite acceleration."""

from pathlib import Path

import matplotlib.pyplot as plt
from nodlidar_common.arrays import Integers
from nodlidar_common.dynamics import REVERSAL_ACCELERATION
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.world.nod_motion import triangle_motion
import numpy as np
from rich.console import Console
from rich.table import Table

from bench.shared.report import Row, table
from figures.repeats import BLOCK, N_L, TASK
from figures.saving import save

SAMPLES = 3009, 5009, 7009
# Errors of the reversals [s]: none, and the one at which most ratios of Table I are reached.
REVERSAL_ERRORS = (0.0, 0.0003)
# Parts of the span that are counted separately; the outer tenths are near the reversals.
BINS = 100
OUTER = BINS // 10
SEED = 1


def draw(folder: Path, console: Console) -> Table:
    """Draw the repeats over the pitch into repeats_by_height.png; return their counts."""
    rows: list[Row] = []
    figure, axes = plt.subplots(1, len(REVERSAL_ERRORS), figsize=(11.0, 4.2), sharey=True)
    middle = np.degrees(TASK.pitch_min + (np.arange(BINS) + 0.5) / BINS * TASK.span)
    for shown, error in zip(axes, REVERSAL_ERRORS, strict=True):
        for n_s in SAMPLES:
            with console.status(f'Fig. 10: N_s = {n_s}'):
                beams, repeats = counts_by_height(n_s, error)
            shown.plot(middle, repeats / np.maximum(beams, 1), label=f'N_s = {n_s}')
            near, between = _near_and_between(beams, repeats)
            rows.append(
                {
                    'reversals off by [ms]': error * 1e3,
                    'N_s': n_s,
                    'repeats': int(repeats.sum()),
                    'share near the reversals': near,
                    'between them': between,
                }
            )
        shown.set(xlabel='pitch φ [deg]', title=f'reversals {error * 1e3:g} ms off')
    axes[0].set(ylabel='share of beams that repeat', ylim=(0.0, 1.0))
    axes[0].legend(loc='upper center')
    save(figure, folder / 'repeats_by_height.png')
    return table('Fig. 10: repeats in N_s revolutions', rows)


def _near_and_between(beams: Integers, repeats: Integers) -> tuple[float, float]:
    """Return the share of repeats in the outer parts of the span, and in those between."""
    inner = slice(OUTER, BINS - OUTER)
    between = repeats[inner].sum() / beams[inner].sum()
    near = (repeats.sum() - repeats[inner].sum()) / (beams.sum() - beams[inner].sum())
    return float(near), float(between)


def counts_by_height(
    samples_per_sweep: int, reversal_error: float, acceleration: float = REVERSAL_ACCELERATION
) -> tuple[Integers, Integers]:
    """Return the number of beams in each part of the span in N_s revolutions, and of repeats.

    Dark beams count as well. A repeat is in a cell of the finest grid that an earlier beam hit.

    Parameters
    ----------
    samples_per_sweep
        N_s, the number of rows.
    reversal_error
        Standard deviation of the instants of the reversals [s].
    acceleration
        Of the reversals [rad/s^2].
    """
    duration = samples_per_sweep * TASK.beam_period
    nod = Nod(
        TASK.pitch_min,
        TASK.pitch_max,
        duration,
        samples_per_sweep,
        -round(0.5 * TASK.beam_period * NS_PER_S),
    )
    end_ns = round(samples_per_sweep * N_L * TASK.beam_period * NS_PER_S)
    motion = triangle_motion(nod, 0, end_ns, acceleration, reversal_error, SEED)
    seen = np.zeros(samples_per_sweep * N_L, dtype=bool)
    beams, repeats = np.zeros((2, BINS), dtype=np.int64)
    for begin in range(0, len(seen), BLOCK * N_L):
        n = np.arange(begin, min(begin + BLOCK * N_L, len(seen)))
        pitch = motion.position(np.rint(n * (TASK.beam_period * NS_PER_S)).astype(np.int64))
        height = np.clip((pitch - TASK.pitch_min) / TASK.span, 0.0, 1.0 - 1e-12)
        cell = (height * samples_per_sweep).astype(np.int64) * N_L + n % N_L
        part = (height * BINS).astype(np.int64)
        # Within a block, too, only the first hit of a cell is new.
        new = np.zeros(len(n), dtype=bool)
        new[np.unique(cell, return_index=True)[1]] = True
        new &= ~seen[cell]
        seen[cell] = True
        beams += np.bincount(part, minlength=BINS)
        repeats += np.bincount(part[~new], minlength=BINS)
    return beams, repeats
