"""Table I: repeats over the timing error of the servo, for the published pairs of N_s.

A repeat is a beam in a cell of the finest grid (azimuth step x rows of span / N_s) that an earlier
beam has hit, within N_s revolutions. The share of repeats among all beams is compared.
"""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
import math
from pathlib import Path

from matplotlib.axes import Axes
import matplotlib.pyplot as plt
from nodlidar_common.arrays import Array
from nodlidar_planner.choice.timing_error import reversal_instants
from nodlidar_planner.pattern.pattern import HALF_SAMPLE
from nodlidar_planner.pattern.task import Task
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from figures.saving import save

Reversals = Callable[[int, float, int], Array]

TASK = Task()
N_L = TASK.steps_per_revolution
# Even and odd N_s of Table I, and the repeats that were counted for each.
PUBLISHED = {
    (3000, 3009): (65532, 51733),
    (4000, 4009): (77017, 64021),
    (5000, 5009): (84315, 72011),
    (6000, 6009): (106947, 87013),
    (7000, 7009): (122543, 96257),
}
AT_RANDOM = math.exp(-1.0)
SHOWN = ('no error', '0.1 ms', '1 ms', 'speed only, 0.1 ms', 'speed only, 1 ms')
COLOURS = ('tab:blue', 'tab:orange', 'tab:green', 'tab:red', 'tab:purple')
# Standard deviations of the reversals' instants, in beam periods (98 us): 0 to 8 ms.
ERRORS = np.array(
    [
        0,
        0.05,
        0.1,
        0.2,
        0.3,
        0.5,
        0.7,
        1,
        1.25,
        1.5,
        1.75,
        2,
        2.5,
        3,
        5,
        7.5,
        10.24,
        14,
        20,
        30.72,
        81.92,
    ]
)
SEEDS = (1, 2)
# Step of the speed register of an RX-24F [rad/s].
SPEED_STEP = 0.111 * math.tau / 60.0
# Revolutions that are computed at once.
BLOCK = 256


@dataclass(frozen=True, slots=True)
class Shares:
    """Share of repeats by N_s: with reversals held in phase, and by speed commands only.

    Each is of shape (errors,), mean over the seeds.
    """

    locked: dict[int, Array]
    by_speed: dict[int, Array]


def draw(folder: Path, console: Console) -> Table:
    """Draw the shares into repeats.png; return Table I as published and as found."""
    shares = compute(console)
    figure, axes = plt.subplots(1, 2, figsize=(11.0, 4.6))
    _draw_shares(axes[0], shares)
    _draw_ratios(axes[1], shares)
    save(figure, folder / 'repeats.png')
    return _findings(shares)


def compute(console: Console) -> Shares:
    """Return the shares, computed by as many processes as there are processors."""
    samples = [n_s for pair in PUBLISHED for n_s in pair]
    runs = list(product((_locked, _by_speed), samples, ERRORS, SEEDS))
    with ProcessPoolExecutor() as pool:
        found = pool.map(_share_of, *zip(*runs, strict=True), chunksize=4)
        tracked = track(found, 'Table I', total=len(runs), console=console)
        shares = np.array(list(tracked)).reshape(2, len(samples), len(ERRORS), -1).mean(axis=-1)
    locked, by_speed = (dict(zip(samples, rows, strict=True)) for rows in shares)
    return Shares(locked, by_speed)


def share_of_repeats(samples_per_sweep: int, reversals: Array) -> float:
    """Return the share of repeats among the beams of N_s revolutions, dark ones counted.

    Parameters
    ----------
    samples_per_sweep
        N_s, the number of rows.
    reversals
        Instants of the reversals [samples], ascending, as of reversal_instants.
    """
    seen = np.zeros(samples_per_sweep * N_L, dtype=bool)
    total = samples_per_sweep * N_L
    sweep = np.arange(float(len(reversals)))
    for begin in range(0, total, BLOCK * N_L):
        n = np.arange(begin, min(begin + BLOCK * N_L, total))
        height = 1.0 - np.abs(np.interp(n, reversals, sweep) % 2.0 - 1.0)
        row = np.minimum((height * samples_per_sweep).astype(np.int64), samples_per_sweep - 1)
        seen[row * N_L + n % N_L] = True
    return 1.0 - float(np.count_nonzero(seen)) / total


def error_where(ratios: Array, published: float) -> float:
    """Return the first error [beam periods] at which ratios that rise reach the published one."""
    after = int(np.argmax(ratios >= published))
    between = slice(after - 1, after + 1)
    return float(np.interp(published, ratios[between], ERRORS[between]))


def _share_of(reversals: Reversals, samples_per_sweep: int, error: float, seed: int) -> float:
    return share_of_repeats(samples_per_sweep, reversals(samples_per_sweep, error, seed))


def _locked(samples_per_sweep: int, error: float, seed: int) -> Array:
    """Return reversals whose errors are white: independent of each other."""
    last = samples_per_sweep * N_L
    return reversal_instants(samples_per_sweep, HALF_SAMPLE, error, last, seed)


def _by_speed(samples_per_sweep: int, error: float, seed: int) -> Array:
    """Return reversals at the speed of the register; each counts from the one before it."""
    speed = round(TASK.speed(samples_per_sweep) / SPEED_STEP) * SPEED_STEP
    sweep = TASK.span / speed / TASK.beam_period
    count = math.ceil(samples_per_sweep * N_L / sweep * 1.1) + 4
    noise = np.random.default_rng(seed).normal(0.0, error, count)
    return np.maximum.accumulate(np.arange(count) * sweep - HALF_SAMPLE + np.cumsum(noise))


def _ratios(shares: dict[int, Array]) -> dict[tuple[int, int], Array]:
    """Return share of repeats of the odd N_s over that of the even one, for each pair."""
    return {(even, odd): shares[odd] / shares[even] for even, odd in PUBLISHED}


def _milliseconds(error: float | Array) -> Array:
    return np.asarray(error * TASK.beam_period * 1e3)


def _draw_shares(axes: Axes, shares: Shares) -> None:
    for pair, colour in zip(PUBLISHED, COLOURS, strict=True):
        for n_s, line in zip(pair, ('-', '--'), strict=True):
            axes.plot(
                _milliseconds(ERRORS), shares.locked[n_s], line, color=colour, label=f'{n_s}'
            )
    axes.axhline(AT_RANDOM, color='grey', lw=0.8, label='at random, 1/e')
    axes.set_title('Repeats on the finest grid, reversals held in phase')
    axes.set(ylabel='share of all beams', ylim=(0.0, 1.0))
    _finish(axes, 'upper right')


def _draw_ratios(axes: Axes, shares: Shares) -> None:
    locked, by_speed = _ratios(shares.locked), _ratios(shares.by_speed)
    for pair, colour in zip(PUBLISHED, COLOURS, strict=True):
        axes.plot(_milliseconds(ERRORS), locked[pair], color=colour, label='{} / {}'.format(*pair))
        axes.plot(_milliseconds(ERRORS), by_speed[pair], ':', color=colour)
        published = _published_ratio(pair)
        reached = _milliseconds(error_where(locked[pair], published))
        axes.plot(reached, published, 'o', color=colour)
    axes.plot([], [], 'o', color='grey', label='published')
    axes.plot([], [], ':', color='grey', label='speed commands only')
    axes.set(title='Odd over even N_s', ylabel='ratio of the shares', ylim=(0.0, 1.5))
    _finish(axes, 'lower right')


def _finish(axes: Axes, place: str) -> None:
    axes.set_xscale('symlog', linthresh=0.02)
    axes.set_xlim(0.0, _milliseconds(ERRORS)[-1])
    axes.set_xlabel('timing error of the reversals [ms], standard deviation')
    axes.legend(fontsize='small', loc=place)


def _published_ratio(pair: tuple[int, int]) -> float:
    even, odd = PUBLISHED[pair]
    return odd / even


def _findings(shares: Shares) -> Table:
    """Return Table I as published and as found, the shares of even and odd and their ratio."""
    locked, by_speed = _ratios(shares.locked), _ratios(shares.by_speed)
    table = Table(title='Table I: repeats of N_s frames, even and odd N_s')
    for name in ('N_s', 'published', *SHOWN, 'reached at'):
        table.add_column(name)
    for pair, counts in PUBLISHED.items():
        for n_s, count in zip(pair, counts, strict=True):
            table.add_row(f'{n_s}', f'{count}', *_shown(shares.locked[n_s], shares.by_speed[n_s]))
        published = _published_ratio(pair)
        reached = _milliseconds(error_where(locked[pair], published))
        table.add_row(
            'ratio', f'{published:.2f}', *_shown(locked[pair], by_speed[pair]), f'{reached:.2f} ms'
        )
        table.add_section()
    return table


def _shown(locked: Array, by_speed: Array) -> list[str]:
    """Return the columns of SHOWN."""
    none, tenth, one = np.searchsorted(ERRORS, (0.0, 1.0, 10.24))
    return [f'{x:.3f}' for x in (*locked[[none, tenth, one]], *by_speed[[tenth, one]])]
