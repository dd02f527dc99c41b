"""Fig. 6: completion (a) and revisit (b) over N_s and start pitch, hit frequency (c) over cells.

The number of cells of Fig. 6c follows from the distance at which the object is to be found.
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
import matplotlib.pyplot as plt
from nodlidar_common.arrays import Array, Integers
from nodlidar_planner.coverage.coverage import Coverage
from nodlidar_planner.coverage.lower_bound import lower_bound
from nodlidar_planner.pattern.band import samples_in_band
from nodlidar_planner.pattern.pattern import HALF_SAMPLE, Pattern
from nodlidar_planner.pattern.task import Task
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from bench.nod.published_choice import DISTANCES, figures_of, PUBLISHED, task_at
from bench.shared.reference import FULL_CIRCLE
from figures.saving import save

STARTS = np.arange(91)
# N_s that a process computes at a time.
CHUNK = 50

PANELS = {
    'completion': 'Fig. 6a: time until every cell was hit [s]',
    'revisit': 'Fig. 6b: longest time between two crossings of a cell, mean over cells [s]',
}


@dataclass(frozen=True, slots=True)
class Maps:
    """Completion and revisit (N_s, starts), hit frequency (N_s, distances), and the N_s."""

    samples: Integers
    completion: Array
    revisit: Array
    frequency: Array


def draw(folder: Path, console: Console) -> Table:
    """Draw the maps into coverage.png; return the published and our findings."""
    maps = compute(samples_in_band(FULL_CIRCLE), console)
    figure, axes = plt.subplots(4, 1, figsize=(11.0, 13.0), height_ratios=(2, 1.3, 1.3, 1.3))
    _draw_completions(axes[0], maps)
    for shown, (name, title) in zip(axes[1:3], PANELS.items(), strict=True):
        values = getattr(maps, name)
        norm = _colours(values)
        edges = maps.samples[0], maps.samples[-1], STARTS[0], STARTS[-1]
        image = shown.imshow(
            values.T, origin='lower', aspect='auto', extent=edges, norm=norm, cmap='viridis',
            interpolation='nearest',
        )  # fmt: skip
        shown.axvline(PUBLISHED, color='white', linewidth=0.8, linestyle=':')
        shown.set(title=title, ylabel='start above limit [deg]', xlabel='N_s')
        figure.colorbar(image, ax=shown, pad=0.01)
    figure.colorbar(_draw_frequency(axes[3], maps), ax=axes[3], pad=0.01)
    save(figure, folder / 'coverage.png', dpi=100)
    return _findings(maps)


def compute(samples: Integers, console: Console) -> Maps:
    """Return the maps, computed by as many processes as there are processors."""
    chunks = [samples[i : i + CHUNK] for i in range(0, len(samples), CHUNK)]
    with ProcessPoolExecutor() as pool:
        results = pool.map(_rows_of_maps, chunks)
        rows = list(track(results, 'Fig. 6', total=len(chunks), console=console))
    return Maps(samples, *(np.concatenate(panel) for panel in zip(*rows, strict=True)))


def _rows_of_maps(samples: Integers) -> tuple[Array, Array, Array]:
    """Return completion, revisit (N_s, starts) and hit frequency (N_s, distances) of some N_s."""
    panels = np.array([maps_of(FULL_CIRCLE, int(n_s)) for n_s in samples])
    return panels[:, 0], panels[:, 1], np.array([frequencies_of(int(n_s)) for n_s in samples])


def frequencies_of(samples_per_sweep: int) -> list[float]:
    """Return the hit frequency at each of the DISTANCES [Hz]."""
    return [figures_of(task_at(each), samples_per_sweep).hit_frequency for each in DISTANCES]


def maps_of(task: Task, samples_per_sweep: int) -> Array:
    """Return completion and revisit for every start, shape (2, starts).

    The phase is the one nearest to the start that is half a sample past a whole one.
    """
    whole = np.minimum(STARTS * samples_per_sweep // STARTS[-1], samples_per_sweep - 1)
    stride = Pattern(task.steps_per_revolution, samples_per_sweep).stride
    panels = np.empty((2, len(STARTS)))
    for rest in np.unique(whole % stride):
        pattern = Pattern(task.steps_per_revolution, samples_per_sweep, rest + HALF_SAMPLE)
        coverage = Coverage(task, pattern)
        figures = coverage.figures()
        for start in np.flatnonzero(whole % stride == rest):
            # The pattern of this phase is that of the rest, some revolutions later.
            begun = int(pattern.whole_revolutions(whole[start] - rest))
            completion = coverage.completion_time(begun)
            panels[:, start] = completion, figures.revisit_mean
    return panels


def _draw_frequency(axes: Axes, maps: Maps) -> QuadMesh:
    cells = [task_at(each).cells for each in DISTANCES]
    norm = _colours(maps.frequency)
    image = axes.pcolormesh(maps.samples, cells, maps.frequency.T, norm=norm, shading='nearest')
    axes.axvline(PUBLISHED, color='white', linewidth=0.8, linestyle=':')
    axes.set(yscale='log', ylabel='number of cells', xlabel='N_s')
    axes.set_title(f'Fig. 6c: crossings of a cell per second [Hz], {DISTANCES[0]} to 4 m')
    return image


def _colours(values: Array) -> LogNorm:
    return LogNorm(*np.quantile(values, [0.001, 0.95]))


def _draw_completions(axes: Axes, maps: Maps) -> None:
    least, most = maps.completion.min(axis=1), maps.completion.max(axis=1)
    axes.fill_between(maps.samples, least, most, color='tab:orange', label='all starts', lw=0.4)
    axes.plot(
        maps.samples, maps.completion[:, 0], color='tab:blue', lw=0.5, label='start at limit'
    )
    axes.axvline(PUBLISHED, color='black', linewidth=0.8, linestyle=':', label=f'{PUBLISHED}')
    bound = lower_bound(FULL_CIRCLE, int(maps.samples[0]))
    axes.axhline(bound, color='tab:green', linewidth=1.0, label='no nod is faster')
    axes.set(yscale='log', xlabel='N_s', ylabel='completion [s]', xlim=maps.samples[[0, -1]])
    axes.set_title('10 cm at 2 m, full circle, span π/2: completion over N_s')
    axes.legend(loc='upper right', ncols=4)


def _findings(maps: Maps) -> Table:
    """Return the published and our findings."""
    at_limit = maps.completion[:, 0]
    best, published = int(np.argmin(at_limit)), int(np.searchsorted(maps.samples, PUBLISHED))
    spread = maps.completion.max(axis=1) / maps.completion.min(axis=1)
    table = Table(title='Fig. 6: coverage over N_s and start pitch')
    table.add_column('published')
    table.add_column('found')
    table.add_row(
        f'N_s = {PUBLISHED} is in a good band, about 10 s',
        f'{at_limit[published]:.1f} s ({maps.completion[published].min():.1f} to '
        f'{maps.completion[published].max():.1f} over the starts); median of all N_s '
        f'{np.median(at_limit):.1f} s, {np.mean(at_limit < at_limit[published]):.0%} are faster',
    )
    table.add_row(
        '', f'best: N_s = {maps.samples[best]}, {at_limit[best]:.1f} s; no nod below '
        f'{lower_bound(FULL_CIRCLE, int(maps.samples[0])):.1f} s',
    )  # fmt: skip
    table.add_row(
        'completion hardly depends on the start pitch',
        f'longest / shortest over the starts: median {np.median(spread):.2f}, '
        f'90 % below {np.quantile(spread, 0.9):.2f}, largest {spread.max():.1f}',
    )
    change = (maps.revisit.max(axis=1) / maps.revisit.min(axis=1)).max() - 1.0
    table.add_row(
        f'Fig. 6b: N_s = {PUBLISHED} is in a good band',
        f'{maps.revisit[published, 0]:.2f} s; median of all N_s {np.median(maps.revisit):.2f}; '
        f'changes by up to {change:.1%} with the start',
    )
    for at in (1.0, 2.0, 4.0):
        found = maps.frequency[:, DISTANCES.index(at)]
        table.add_row(
            f'Fig. 6c: hit frequency of {task_at(at).cells} cells',
            f'{found[published]:.3f} Hz; all N_s {found.min():.3f} to {found.max():.3f}',
        )
    return table
