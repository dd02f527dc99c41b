"""Fig. 10: where in the nod beams repeat, with reversals of finite acceleration."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')
import matplotlib.pyplot as plt
from nodlidar_common.nod import NodTrajectory, NS_PER_S
from nodlidar_sim.world.motion import REVERSAL_ACCELERATION, triangle_motion
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from figures.repeats import BLOCK, N_L, TASK
from figures.saving import save

SAMPLES = 3009, 5009, 7009
# Errors of the turns [s]: none, and that at which most of Table I's ratios come out.
TURN_ERRORS = (0.0, 0.0003)
# Parts of the span that are counted apart; the outer tenths are called the turns.
BINS = 100
OUTER = BINS // 10
SEED = 1


def draw(folder: Path, console: Console) -> Table:
    """Draw the repeats over the pitch into repeats_by_height.png; return their counts."""
    table = Table(title='Fig. 10: repeats in N_s revolutions')
    for heading in ('turns off by', 'N_s', 'repeats', 'share near the turns', 'between them'):
        table.add_column(heading, justify='right')
    figure, axes = plt.subplots(1, len(TURN_ERRORS), figsize=(11.0, 4.2), sharey=True)
    middle = np.degrees(TASK.pitch_min + (np.arange(BINS) + 0.5) / BINS * TASK.span)
    for shown, error in zip(axes, TURN_ERRORS, strict=True):
        for n_s in SAMPLES:
            with console.status(f'Fig. 10: N_s = {n_s}'):
                beams, repeats = counts_by_height(n_s, error)
            shown.plot(middle, repeats / np.maximum(beams, 1), label=f'N_s = {n_s}')
            shares = (f'{share:.3f}' for share in _near_and_between(beams, repeats))
            table.add_row(f'{error * 1e3:g} ms', f'{n_s}', f'{repeats.sum():,}', *shares)
        shown.set(xlabel='pitch φ [deg]', title=f'turns {error * 1e3:g} ms off')
    axes[0].set(ylabel='share of beams that repeat', ylim=(0.0, 1.0))
    axes[0].legend(loc='upper center')
    save(figure, folder / 'repeats_by_height.png')
    return table


def _near_and_between(beams: NDArray[np.int64], repeats: NDArray[np.int64]) -> tuple[float, float]:
    """Return the share of repeats in the outer parts of the span, and in those between."""
    inner = slice(OUTER, BINS - OUTER)
    between = repeats[inner].sum() / beams[inner].sum()
    near = (repeats.sum() - repeats[inner].sum()) / (beams.sum() - beams[inner].sum())
    return float(near), float(between)


def counts_by_height(
    samples_per_sweep: int, turn_error: float, acceleration: float = REVERSAL_ACCELERATION
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return how many beams fall in each part of the span in N_s revolutions, and repeats of them.

    Dark beams count as well. A repeat falls in a cell of the finest grid that one before it hit.

    Parameters
    ----------
    samples_per_sweep
        N_s, which the rows are made for.
    turn_error
        Standard deviation of the turns' instants [s].
    acceleration
        Of the reversals [rad/s2].
    """
    duration = samples_per_sweep * TASK.sample_time
    nod = NodTrajectory(
        TASK.pitch_min,
        TASK.pitch_max,
        duration,
        samples_per_sweep,
        -round(0.5 * TASK.sample_time * NS_PER_S),
    )
    end_ns = round(samples_per_sweep * N_L * TASK.sample_time * NS_PER_S)
    motion = triangle_motion(nod, 0, end_ns, acceleration, turn_error, SEED)
    seen = np.zeros(samples_per_sweep * N_L, dtype=bool)
    beams, repeats = np.zeros((2, BINS), dtype=np.int64)
    for begin in range(0, len(seen), BLOCK * N_L):
        n = np.arange(begin, min(begin + BLOCK * N_L, len(seen)))
        pitch = motion.position(np.rint(n * (TASK.sample_time * NS_PER_S)).astype(np.int64))
        height = np.clip((pitch - TASK.pitch_min) / TASK.span, 0.0, 1.0 - 1e-12)
        cell = (height * samples_per_sweep).astype(np.int64) * N_L + n % N_L
        part = (height * BINS).astype(np.int64)
        # Within a block a cell may be hit twice, too: only the first of them is new.
        new = np.zeros(len(n), dtype=bool)
        new[np.unique(cell, return_index=True)[1]] = True
        new &= ~seen[cell]
        seen[cell] = True
        beams += np.bincount(part, minlength=BINS)
        repeats += np.bincount(part[~new], minlength=BINS)
    return beams, repeats
