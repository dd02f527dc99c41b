"""Odometry of the last seconds: whether it moves as a robot does."""

from collections import deque
from collections.abc import Sequence

from nodlidar_assembler.plausibility.odometry_held import held_poses
from nodlidar_assembler.plausibility.odometry_jitter import (
    ends_of,
    FEWEST_SAMPLES,
    OdometryJitter,
    offsets,
    WINDOW_NS,
)
from nodlidar_assembler.plausibility.point_error import DISTANCE, LEAST_ERROR
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
import numpy as np

MOST_SAMPLES = 2000  # of WINDOW_NS
LEAPS = 3  # one or two may be corrections
GRAVITY = 9.8  # m/s^2, which a robot on wheels or feet accelerates by at most: it would slip
LEVER = 0.2  # m from its middle, where they are: a turn accelerates by no more there
SURE = 8.0  # standard deviations of the noise, which hardly any sample seems to leap by
_JUDGED_EVERY_NS = NS_PER_S
_MEDIAN = 0.4  # product of offsets of white noise of variance 1 in one coordinate, by simulation
_TURN = DISTANCE * (2.0 / 3.0) ** 0.5  # way of points by a turn by 1 rad, RMS over all directions


class OdometryCheck:
    """Finds poses that are held, whose stamps jitter, or that scatter or leap.

    The last two are off the straight way between their neighbours, back and forth. Acceleration
    and noise both put a sample off that way. Acceleration lasts, so that the offsets of two
    samples in a row point the same way. With noise they point back: their mean product is minus
    the variance of white noise, and a single leap by l has a product of -l^2 / 4.

    As an offset counts how far points at DISTANCE move, RMS over all directions.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Sequence[float], Sequence[float]]] = deque(
            maxlen=MOST_SAMPLES
        )
        self._judged_ns, self._warning = 0, ''

    def add(self, time_ns: int, position: Sequence[float], orientation: Sequence[float]) -> None:
        """Add a sample: time [ns], x y z [m], quaternion x y z w."""
        samples = self._samples
        if samples and not 0 < time_ns - samples[-1][0] < WINDOW_NS:
            samples.clear()
        samples.append((time_ns, position, orientation))
        while time_ns - samples[0][0] > WINDOW_NS:
            samples.popleft()

    @property
    def warning(self) -> str:
        """How far points are off by it; empty if they are not."""
        newest_ns = self._samples[-1][0] if self._samples else 0
        if abs(newest_ns - self._judged_ns) >= _JUDGED_EVERY_NS:
            self._judged_ns, self._warning = newest_ns, self._judge()
        return self._warning

    def _judge(self) -> str:
        if len(self._samples) < FEWEST_SAMPLES:
            return ''
        times_ns, positions, orientations = map(np.array, zip(*self._samples, strict=True))
        if held := held_poses(times_ns, positions, orientations):
            return held
        ends = ends_of(orientations)
        jitter = OdometryJitter.of(times_ns, positions, ends)
        if jitter is not None:
            return f'stamps of odometry jitter by {jitter}'
        off, off_turn, half_square = offsets(times_ns, positions, ends)
        back = _back(off, off_turn)
        # A single leap hardly changes the median; of a vibration, the mean shows its size.
        variance = min(float(np.median(back)) / _MEDIAN, float(back.mean()))
        scatter = max(variance, 0.0) ** 0.5
        if scatter > LEAST_ERROR:
            return (
                f'odometry scatters from sample to sample: points {DISTANCE:g} m away are '
                f'{scatter * 1e3:.0f} mm off RMS; check what computes it'
            )
        beyond = _back(
            _beyond(off, GRAVITY * half_square),
            _beyond(off_turn, _TURN * GRAVITY / LEVER * half_square),
        )
        least = max(LEAST_ERROR, SURE / 2.0 * scatter)
        leaps = 2.0 * np.sqrt(np.maximum(back[beyond > least**2], 0.0))
        if len(leaps) < LEAPS:
            return ''
        return (
            f'odometry leaps: {len(leaps)} times in {WINDOW_NS / NS_PER_S:g} s, points '
            f'{DISTANCE:g} m away by {np.median(leaps) * 1e3:.0f} mm; check what computes it'
        )


def _beyond(offset: Array, allowed: Array) -> Array:
    """Return what of offsets (n, k) is beyond an allowed size (n,)."""
    size = np.maximum(np.linalg.norm(offset, axis=1), 1e-300)
    return np.asarray(offset * np.maximum(1.0 - allowed / size, 0.0)[:, None])


def _back(*offsets: Array) -> Array:
    """Return how much offsets (n, k) point back to the ones before [m^2], shape (n - 1,)."""
    products = (np.einsum('ij,ij->i', each[1:], each[:-1]) for each in offsets)
    return -np.asarray(sum(products))
