"""Calibration by local thickness, after LiMo-Calib, beside ours on the same recordings.

Li et al., "LiMo-Calib: On-Site Fast LiDAR-Motor Calibration for Quadruped Robot-Based Panoramic 3D
Sensing System", IROS 2025. As there, the points around the centres of cubes make a plane each, if
they are flat. Planes count by their flatness, and as many of each direction. A round moves the
values so that the points of each neighbourhood come together along its normal, which stays; then
neighbourhoods are formed again.

A nod sees a spot at one nod angle only. So points need not be 60 deg of the motor apart, and are
compared with their mean instead of one of them. The delay is one more value, and all have the
start and the spread before any data that ours have.

The settings were chosen in the scene `corner` and in buildings of `drawn_buildings`. Without
errors of the lidar, larger neighbourhoods can be used, and planes may tilt within a round: the
same minimum, in fewer rounds. With errors, that diverges.
"""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
import math

from nodlidar_assembler.calibration.beam_model import ends_of, MeasuredBeams, Values
from nodlidar_assembler.calibration.calibration import calibrate, coarse_delay
from nodlidar_assembler.calibration.plane_search import patches
from nodlidar_assembler.calibration.plane_system import BEFORE
from nodlidar_assembler.commands.calibrate import ROWS
from nodlidar_common.arrays import Array, Integers
import numpy as np
from scipy.spatial import cKDTree

from bench.errors.calibration import Case, CASES, recording, START
from bench.shared.report import Row
from bench.shared.rms import rms

TITLE = 'Calibration of the same recordings by local thickness and by ours, RMS errors'
NAMES = ('delay', 'roll', 'yaw', 'x', 'z')
PRIOR = np.array([BEFORE[name] for name in NAMES]) ** -2.0
RUNS, ROUNDS = 4, 10
THINNED = 3  # every third beam: all would take longer and give the same
BINS = 18  # of half a turn, for the directions of normals
LEAST_POINTS = 10


@dataclass(frozen=True, slots=True)
class Settings:
    """Radius of neighbourhoods [m], their least planarity, and whether their planes tilt."""

    radius: float
    planarity: float
    tilting: bool


WITHOUT_NOISE, WITH_NOISE = Settings(0.9, 0.9, True), Settings(0.45, 0.8, False)
BOTH = ('room, ideal servo', 'room, RX-24F', 'corridor', 'rooms of the building', 'panelled rooms')
COMPARED = {
    'room, ideal lidar and servo': (Case('room', RUNS, ideal=True), WITHOUT_NOISE),
    **{name: (CASES[name], WITH_NOISE) for name in BOTH},
}


@dataclass(frozen=True, slots=True)
class _Patch:
    """A neighbourhood: its points, principal axes (3, 3), that of the normal first, planarity."""

    points: Integers
    axes: Array
    planarity: float


def results() -> list[Row]:
    """Return the errors in each case: as put in, by local thickness, and by ours."""
    with ProcessPoolExecutor(2) as pool:
        started = {
            name: [pool.submit(run, *case, seed) for seed in range(RUNS)]
            for name, case in COMPARED.items()
        }
        found = {name: [each.result() for each in runs] for name, runs in started.items()}
    return [
        _row(name, by, np.array(errors))
        for name, runs in found.items()
        for by, errors in zip(
            ('none', 'local thickness', 'ours'), zip(*runs, strict=True), strict=True
        )
    ]


def run(case: Case, settings: Settings, seed: int) -> Array:
    """Return errors without calibration, by local thickness, and by ours, shape (3, values).

    They are NaN where ours leaves a value open.
    """
    log, true, up = recording(case, seed)
    beams = MeasuredBeams.of(log)
    ours = calibrate(beams, START, up)
    found = START, thinnest(beams, START, settings), ours.values
    errors = np.array([_difference(values, true) for values in found])
    errors[2, [name in ours.undetermined for name in NAMES]] = np.nan
    return errors


def _row(case: str, by: str, errors: Array) -> Row:
    row: Row = {'case': case, 'calibration': by}
    for name, column in zip(NAMES, errors.T, strict=True):
        _, unit, scale = ROWS[name]
        row[f'{name} [{unit}]'] = rms(column[np.isfinite(column)]) * scale
    open_ = np.count_nonzero(np.isnan(errors), axis=0)
    row['left open'] = ', '.join(f'{n} {k}' for n, k in zip(NAMES, open_, strict=True) if k)
    return row


def thinnest(beams: MeasuredBeams, start: Values, settings: Settings) -> Values:
    """Return the values with which neighbourhoods are thinnest."""
    rng = np.random.default_rng(0)
    values = replace(start, delay=start.delay + coarse_delay(beams, start))
    known = beams[::THINNED]
    known = known[np.isfinite(ends_of(known, values, False).xyz[0])]
    for _ in range(ROUNDS):
        ends = ends_of(known, values)
        moves = np.stack([ends.moves[name] for name in NAMES], axis=1)
        normal, right, squares, weights, count = np.zeros((5, 5)), np.zeros(5), 0.0, 0.0, 0
        for patch in _homogenised(list(_patches(ends.xyz, settings)), rng):
            across, *along = patch.axes.T @ _centred(ends.xyz[:, patch.points])
            slopes = _centred(np.tensordot(patch.axes[:, 0], moves[:, :, patch.points], 1))
            if settings.tilting:
                basis = np.stack(along)
                slopes -= np.linalg.lstsq(basis.T, slopes.T, rcond=None)[0].T @ basis
            normal += patch.planarity * slopes @ slopes.T
            right += patch.planarity * slopes @ across
            squares += patch.planarity * across @ across
            weights += patch.planarity * len(across)
            count += len(across)
        # Neighbourhoods overlap: each point tells what it tells once.
        variance = squares / weights * max(1.0, count / len(known))
        right = right / variance + PRIOR * _difference(values, start)
        step = -np.linalg.solve(normal / variance + np.diag(PRIOR), right)
        values = values.moved(NAMES, step)
    return values


def _patches(xyz: Array, settings: Settings) -> Iterator[_Patch]:
    """Yield the flat neighbourhoods of points (3, n)."""
    cube = patches(xyz, settings.radius)
    centres = np.stack([np.bincount(cube, row) / np.bincount(cube) for row in xyz], axis=1)
    for points in cKDTree(xyz.T).query_ball_point(centres, settings.radius):
        if len(points) < LEAST_POINTS:
            continue
        variance, axes = np.linalg.eigh(np.cov(xyz[:, points]))
        thin, short, long = np.sqrt(np.maximum(variance, 0.0))
        planarity = 2.0 * (short - thin) / (thin + short + long)
        if planarity > settings.planarity:
            yield _Patch(np.array(points), axes, planarity)


def _homogenised(found: list[_Patch], rng: np.random.Generator) -> Iterator[_Patch]:
    """Yield at most the mean number of patches of each direction of the normal, at random."""
    normals = np.array([patch.axes[:, 0] for patch in found])
    x, y, z = (normals * np.where(normals[:, 2:] < 0.0, -1.0, 1.0)).T
    angles = np.stack([np.arccos(z.clip(max=1.0)), np.arctan2(y, x)])
    bins = np.unique(np.floor(angles * (BINS / math.pi)), axis=1, return_inverse=True)[1].ravel()
    most, taken = len(found) / (bins.max() + 1), np.zeros(bins.max() + 1)
    for k in rng.permutation(len(found)):
        taken[bins[k]] += 1
        if taken[bins[k]] <= most:
            yield found[k]


def _centred(rows: Array) -> Array:
    return np.asarray(rows - rows.mean(axis=1)[:, None])


def _difference(one: Values, other: Values) -> Array:
    return np.array([getattr(one, name) - getattr(other, name) for name in NAMES])
