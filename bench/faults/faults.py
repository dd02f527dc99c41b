"""The launched system under random faults: whether they are named and healed, and the errors.

Real nodes on emulated devices; bytes, cables, devices and processes fail one after the other, with
healthy pauses. The published messages are compared with what the devices truly did. An error is
the worst of all messages from a fault's begin until the next fault; the distance of a cloud is the
RMS over its points.
"""

from collections.abc import Iterator
from dataclasses import replace
import json
from pathlib import Path
import tempfile
import time

from nodlidar_common.errors import NodlidarError
from nodlidar_common.terminal import progress_bar
import numpy as np
from rich import get_console

from bench.faults.fault_errors import errors
from bench.faults.fault_judgement import Episode, Judge, Judgement
from bench.faults.fault_kinds import Kind, schedule
from bench.faults.fault_log import read_published
from bench.faults.fault_rig import Rig, START_TIMEOUT
from bench.faults.fault_rows import row
from bench.shared.report import Row

DURATION = 600.0
HEALTHY = 20.0  # before the first fault [s]
PAUSE = 4.0  # from when a fault has healed to the next one [s]
PATIENCE = 20.0  # for it to heal [s]; then the launch is started again
TITLE = f'Random faults for {DURATION:.0f} s: how each was named and healed, and the errors'
NONE, ALL = 'none', 'all'


class UnhealthyError(NodlidarError):
    """The system does not work even without a fault."""


def results(
    duration: float = DURATION, seed: int = 1, only: str = '', keep: Path | None = None
) -> list[Row]:
    """Return the judgement of faults, by kind.

    Parameters
    ----------
    duration
        Of all faults [s].
    seed
        Of the order, sizes and durations of the faults.
    only
        Parts of names of faults, separated by commas: only faults with one of them.
    keep
        A folder for the bag, the nodes' logs and the judgement of each fault.

    Raises
    ------
    UnhealthyError
        If no clouds come before the first fault.
    """
    with tempfile.TemporaryDirectory(prefix='faults-') as temporary:
        folder = Path(temporary) if keep is None else keep
        folder.mkdir(parents=True, exist_ok=True)
        with Rig(folder, seed) as rig:
            episodes = list(_episodes(rig, duration, seed, only))
        published = read_published(folder / 'bag')
        found, healthy_ns = errors(published, rig.truth), _span(episodes[0])
        judge = Judge(published, rig.truth, found, healthy_ns, rig.launches_ns)
        judged = [(episode, judge.judge(episode)) for episode in episodes]
        if keep is not None:
            _write(keep / 'faults.json', judged, rig.truth.scans[0].times_ns[0])
    kinds: dict[str, list[Judgement]] = {}
    for episode, judgement in judged:
        kinds.setdefault(episode.kind, []).append(judgement)
    healthy = kinds.pop(NONE)
    every = row(ALL, [replace(j, text='') for each in kinds.values() for j in each])
    return [
        row(NONE, healthy),
        *(row(name, kinds[name]) for name in sorted(kinds)),
        every | {'unaccounted': judge.unaccounted(episodes)},
    ]


def _span(episode: Episode) -> tuple[int, int]:
    return episode.began_ns, episode.until_ns


def _episodes(rig: Rig, duration: float, seed: int, only: str) -> Iterator[Episode]:
    """Yield a time without faults, then one fault after the other."""
    kinds, rng = schedule(seed, only), np.random.default_rng(seed)
    with progress_bar(console=get_console()) as progress:
        task = progress.add_task('no fault', total=duration)
        if not rig.recorder.spin_until(rig.recorder.healthy, START_TIMEOUT):
            log = (rig.folder / 'launch_1.log').read_text()
            raise UnhealthyError(f'no clouds come, although no fault was caused:\n{log}')
        rig.recorder.spin(PAUSE)
        began_ns = rig.now_ns()
        rig.recorder.spin(HEALTHY)
        yield Episode(NONE, '', None, began_ns, began_ns, began_ns, rig.now_ns())
        started, done = time.monotonic(), 0
        while (elapsed := time.monotonic() - started) < duration:
            kind = kinds[done % len(kinds)]
            progress.update(task, completed=elapsed, description=kind.name)
            yield _episode(rig, kind, rng)
            done += 1


def _episode(rig: Rig, kind: Kind, rng: np.random.Generator) -> Episode:
    """Cause a fault, end it and wait until clouds come again."""
    began_ns, lasting = rig.now_ns(), float(rng.uniform(*kind.durations))
    fault = kind.begin(rig, rng)
    rig.recorder.spin(lasting)
    hit_ns, end_ns = fault.hit_ns(), rig.now_ns()
    fault.end()
    mended_ns = rig.now_ns() if kind.ends_launch else end_ns
    patience = START_TIMEOUT if kind.ends_launch else PATIENCE
    if not rig.recorder.spin_until(rig.recorder.healthy, patience):
        rig.relaunch()
    rig.recorder.spin(PAUSE)
    return Episode(
        kind.name, f'{fault.detail} {lasting:.1f} s'.strip(), hit_ns, end_ns, mended_ns,
        began_ns, rig.now_ns(), kind.ends_launch, lasting >= kind.releases_after,
    )  # fmt: skip


def _write(path: Path, judged: list[tuple[Episode, Judgement]], start_ns: int) -> None:
    """Write the judgement of each fault with its time [s]."""
    rows = [
        {
            'at [s]': round((episode.began_ns - start_ns) / 1e9, 3),
            **row(episode.kind, [judgement]),
            'detail': episode.detail,
        }
        for episode, judgement in judged
    ]
    path.write_text(json.dumps(rows, indent=1) + '\n')
