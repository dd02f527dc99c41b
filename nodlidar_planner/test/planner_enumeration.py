"""What the planner is checked with: the publication's task, and plain enumeration of a pattern."""

from dataclasses import dataclass
import math

from nodlidar_planner.coverage.crossings import NEVER
from nodlidar_planner.pattern.task import Task
import numpy as np

PUBLISHED = Task(0.10, 2.0, -math.pi / 4, math.pi / 4, full_circle=True)


@dataclass(frozen=True)
class Enumerated:
    """First hits, longest gaps and crossings in one period of every cell, (columns, rows)."""

    first: np.ndarray
    longest_gap: np.ndarray
    crossings: np.ndarray


def cells_of_samples(task, pattern, n):
    """Return column * rows + row of each sample; -1 where it is in no cell."""
    begins = task.column_of_step() * task.rows  # of their cells; below 0 in none
    cycle = 2 * pattern.samples_per_sweep
    wave = (np.arange(cycle) + pattern.phase) % cycle
    triangle = pattern.samples_per_sweep - np.abs(wave - pattern.samples_per_sweep)
    height = triangle * (task.span / pattern.samples_per_sweep)
    row = np.minimum(np.floor(height / task.cell + 1e-9).astype(np.int64), task.rows - 1)
    return np.maximum(begins[n % len(begins)] + row[n % cycle], -1)


def enumerate_cells(task, pattern):
    """Enumerate one period."""
    cells = task.columns * task.rows
    period = np.lcm(pattern.steps_per_revolution, 2 * pattern.samples_per_sweep)
    cell = cells_of_samples(task, pattern, np.arange(period, dtype=np.int64))
    first = np.full(cells, NEVER)
    hits = np.flatnonzero(cell >= 0)
    first[cell[hits][::-1]] = hits[::-1]
    begins = np.flatnonzero((cell != np.roll(cell, 1)) & (cell >= 0))
    if len(begins) == 0 and cell[0] >= 0:  # all samples are in one cell, which is never left
        return _shaped(task, first, np.zeros(cells, int), np.bincount(cell[:1], minlength=cells))
    begins = begins[np.argsort(cell[begins], kind='stable')]
    gap = (np.roll(begins, -1) - begins).astype(np.int64)
    last = np.flatnonzero(np.diff(cell[begins], append=-1))
    starts = np.concatenate([[0], last[:-1] + 1]) if len(last) else last
    gap[last] = begins[starts] + period - begins[last]
    longest = np.zeros(cells, dtype=np.int64)
    np.maximum.at(longest, cell[begins], gap)
    return _shaped(task, first, longest, np.bincount(cell[begins], minlength=cells))


def _shaped(task, *figures):
    return Enumerated(*(figure.reshape(task.columns, task.rows) for figure in figures))


def beams(task, pattern, samples):
    """Return azimuth and pitch of every beam in the region, one by one."""
    n = np.arange(samples, dtype=np.int64)
    wave = (n + pattern.phase) % (2 * pattern.samples_per_sweep)
    height = pattern.samples_per_sweep - np.abs(wave - pattern.samples_per_sweep)
    pitch = task.pitch_min + height * (task.span / pattern.samples_per_sweep)
    azimuth, seen = azimuths(task, n)
    return azimuth[seen], pitch[seen]


def azimuths(task, n):
    """Return the azimuth of each sample, and whether it is in the region."""
    step = n % task.steps_per_revolution
    azimuth = task.azimuth_of_step_0 + step * (math.tau / task.steps_per_revolution)
    seen, place = np.zeros(len(n), dtype=bool), np.empty(len(n))
    if task.full_circle:
        return azimuth, ~seen
    for turns in (-2, -1, 0, 1, 2):
        turned = azimuth + turns * math.tau
        seen |= (turned > task.window_min - 1e-9) & (turned < task.window_max + 1e-9)
        near = np.abs(turned - task.centre) <= math.pi
        place[near] = turned[near]
    return place, seen & (np.abs(place - task.centre) < task.azimuth + 1e-9)


def region(task):
    """Return left, right edge of the region; a full circle is unrolled from step 0 on."""
    if task.full_circle:
        return task.azimuth_of_step_0, task.azimuth_of_step_0 + math.tau
    return task.centre - task.azimuth, task.centre + task.azimuth


def unrolled(task, azimuth, pitch):
    """Return the beams with, in a full circle, those of the next turn around as well."""
    if not task.full_circle:
        return azimuth, pitch
    return np.concatenate([azimuth, azimuth + math.tau]), np.concatenate([pitch, pitch])


def widest_by_corners(task, pattern, samples):
    """Grow a square from each corner on a beam's azimuth and a beam's pitch, or the region's."""
    return widest_at(task, *unrolled(task, *beams(task, pattern, samples)))


def widest_at(task, azimuth, pitch):
    """Grow a square from each corner, given all beams, of a full circle as unrolled."""
    left, right = region(task)
    widest = 0.0
    y = np.unique(np.append(pitch, task.pitch_min))[:, None]
    corners = np.unique(np.append(azimuth, left))
    for x in corners[corners < right]:
        room = math.tau if task.full_circle else right - x
        side = np.minimum(room, task.pitch_max - y[:, 0])
        if len(azimuth):
            above = (azimuth > x + 1e-9) & (pitch > y + 1e-9)
            reach = np.maximum(azimuth - x, pitch - y)
            side = np.minimum(side, np.where(above, reach, np.inf).min(axis=1))
        widest = max(widest, side.max())
    return widest
