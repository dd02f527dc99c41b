"""Whether upward and downward sweeps see the same: beams with wrong times move them apart.

In a small cell of azimuth and pitch the range is about ``a + b phi + c theta``. A delay d of the
joint states shifts phi by d times the speed, up in upward sweeps and down in downward ones. So
with a term ``g speed`` fitted beside the others, ``d = g / b`` in every cell where the range
depends on the pitch. Where people walk or the robot moves, cells disagree: their scatter is the
error of d.

If beams are not measured in the order or at the rate that their scan states, d also changes along
the scan, by s for each second after the first beam. In the other order, s is -2.
"""

from nodlidar_assembler.clouds.geometry import Beams
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray

WINDOW = 20.0  # in which a static scene is assumed [s]
EVERY = 4  # beams
AT_ONCE = 10  # scans whose beams are added to the cells in one step
AZIMUTH_CELL, PITCH_CELL = 0.1, 0.1  # [rad]
LEAST_SPEED = 0.1  # at which a beam counts [rad/s]
LEAST_DELAY = 3e-3  # that is reported [s]
LEAST_SLOPE = 0.25  # of the delay along a scan; a robot that turns shows up to 0.2
SURE = 6.0  # standard errors
CONFIRMED = 3  # windows, one after the other, with the same sign
_LEAST_PACE = 0.5  # of beams in the order that scans state; of both orders in turn it is 0
_LEAST_IN_CELL, _LEAST_CELLS = 12, 20
_COLUMNS, _ROWS = 64, 64  # of cells: a turn
_TERMS = 5  # 1, pitch, azimuth, speed, range
# The largest condition number of a cell's equations, their terms scaled to one size. Where a nod
# repeats itself from revolution to revolution, a cell's few beams do not tell speed from pitch.
_MOST_CONDITION = 100.0


class SweepAgreement:
    """Estimates the delay of joint states and the pace of the beams, window by window.

    Attributes
    ----------
    delay, error
        Of the last window: additional delay and its standard error [s]; NaN if it is unknown.
    pace
        Of the last window: true time between beams over that which scans state, negative if beams
        are measured in the other order; NaN if it is unknown.
    """

    def __init__(self) -> None:
        self._beams: Beams | None = None
        self.restart()

    @property
    def warning(self) -> str:
        """What to do if the delay or the pace is off for several windows; else empty."""
        if abs(self._pace_alike) >= CONFIRMED:
            if self.pace < _LEAST_PACE:
                return (
                    'up and down sweeps disagree: beams are measured from the last to the first, '
                    'or ranges are in the wrong order; see last_beam_first'
                )
            return (
                f'up and down sweeps disagree: the time between beams is {self.pace:.2f} times '
                'the time_increment of scans'
            )
        if abs(self._alike) < CONFIRMED:
            return ''
        return (
            f'up and down sweeps disagree: joint_delay is off by {self.delay * 1e3:.1f} ms; '
            'run calibrate'
        )

    def restart(self) -> None:
        """Forget the window, as after the clock was set."""
        self._start_ns: int | None = None
        self._alike = self._pace_alike = 0
        self.delay = self.error = self.pace = float('nan')
        self._clear()

    def excludes(self, delay: float) -> bool:
        """Return whether, by the last window, the delay is nearer to right than to off by this."""
        return abs(self.delay) + SURE * self.error < abs(delay) / 2.0

    def add(self, assembled: Assembled) -> None:
        """Add a scan; ends a window if it is full."""
        stamp_ns = assembled.scan.stamp_ns
        if self._start_ns is None or stamp_ns < self._start_ns:
            self._start_ns = stamp_ns
        if stamp_ns - self._start_ns > WINDOW * NS_PER_S:
            self._end()
            self._start_ns = stamp_ns
        self._gather(assembled)

    def _column_offset(self) -> Array:
        """Return the mean time of the beams in each column after the first beam [s]."""
        if self._beams is None:
            return np.zeros(_COLUMNS)
        column = np.floor(self._beams.azimuth / AZIMUTH_CELL).astype(np.intp) % _COLUMNS
        beams = np.maximum(np.bincount(column, minlength=_COLUMNS), 1)
        return np.asarray(np.bincount(column, self._beams.offset, _COLUMNS) / beams)

    def _clear(self) -> None:
        self._moments = np.zeros((_COLUMNS * _ROWS, _TERMS, _TERMS))
        self._seen: list[Array] = []

    def _gather(self, assembled: Assembled) -> None:
        """Keep pitch, azimuth, speed and range of some beams of a scan."""
        chosen = assembled.placed.indices[::EVERY]
        beams = assembled.beams
        if len(chosen) < 3 or beams.geometry.time_increment == 0.0:
            return
        self._beams = beams
        pitch, offset = assembled.pitch[chosen], beams.offset[chosen]
        inner = chosen[1:-1]
        speed = (pitch[2:] - pitch[:-2]) / (offset[2:] - offset[:-2])
        ranges = assembled.scan.ranges[inner]
        self._seen.append(np.stack([pitch[1:-1], beams.azimuth[inner], speed, ranges]))
        if len(self._seen) == AT_ONCE:
            self._sum_up()

    def _sum_up(self) -> None:
        """Add the kept beams to the moments of their cells."""
        if self._seen:
            cells, moments = _moments(*np.concatenate(self._seen, axis=1))
            self._moments[cells] += moments
            self._seen.clear()

    def _end(self) -> None:
        """Estimate delay and pace of the window, and count the windows that agree on them."""
        self._sum_up()
        found = _fit(*_cell_delays(self._moments), self._column_offset())
        (self.delay, self.error), (slope, slope_error) = found
        self.pace = 1.0 + slope
        self._alike = _counted(self._alike, self.delay, self.error, LEAST_DELAY)
        self._pace_alike = _counted(self._pace_alike, slope, slope_error, LEAST_SLOPE)
        self._clear()


def _moments(
    pitch: Array, azimuth: Array, speed: Array, ranges: Array
) -> tuple[NDArray[np.intp], Array]:
    """Return the cells that beams are in and the sums of products of their terms, (c, 5, 5)."""
    column, row = np.floor(azimuth / AZIMUTH_CELL), np.floor(pitch / PITCH_CELL)
    aside = azimuth - (column + 0.5) * AZIMUTH_CELL
    off = pitch - (row + 0.5) * PITCH_CELL
    used = np.abs(speed) > LEAST_SPEED
    terms = np.stack([np.ones_like(off), off, aside, speed, ranges])[:, used]
    cell = (column % _COLUMNS * _ROWS + row % _ROWS)[used].astype(np.intp)
    cells, place = np.unique(cell, return_inverse=True)
    sums = [np.bincount(place, a * b, len(cells)) for a in terms for b in terms]
    moments = np.stack(sums, axis=1).astype(np.float64)
    return np.asarray(cells), moments.reshape(-1, _TERMS, _TERMS)


def _cell_delays(moments: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Return the column, delay [s] and weight of each cell that shows one, shape (c,) each."""
    column = np.arange(len(moments)) // _ROWS
    full = moments[:, 0, 0] >= _LEAST_IN_CELL
    column, used = column[full], moments[full]
    size = np.sqrt(np.maximum(used[:, range(4), range(4)], 1e-300))
    scaled = np.linalg.eigvalsh(used[:, :4, :4] / (size[:, :, None] * size[:, None]))
    determined = scaled[:, 0] > scaled[:, 3] / _MOST_CONDITION
    column, used = column[determined], used[determined]
    # Not solve or inv: OpenBLAS spreads these over threads, which then keep every processor busy.
    values, vectors = np.linalg.eigh(used[:, :4, :4])
    inverse = (vectors / values[:, None]) @ vectors.transpose(0, 2, 1)
    fit = np.einsum('ckj,cj->ck', inverse, used[:, :4, 4])
    rest = used[:, 4, 4] - np.einsum('ck,ck->c', fit, used[:, :4, 4])
    variance = np.maximum(rest / (used[:, 0, 0] - 4.0), 1e-6)
    weight = fit[:, 1] ** 2 / (variance * inverse[:, 3, 3])
    each = fit[:, 3] / np.where(np.abs(fit[:, 1]) > 1e-3, fit[:, 1], np.inf)
    kept = np.abs(fit[:, 1]) > 3.0 * np.sqrt(variance * inverse[:, 1, 1])
    return column[kept], each[kept], weight[kept]


def _fit(
    column: NDArray[np.intp], each: Array, weight: Array, column_offset: Array
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return delay [s] and slope of a line through the delays of cells, with standard errors.

    Parameters
    ----------
    column, each, weight
        Of the cells, shape (c,).
    column_offset
        Time of the beams in each column after the first beam [s].
    """
    if len(each) < _LEAST_CELLS:
        return (np.nan, np.nan), (np.nan, np.nan)
    offset = column_offset[column]
    for _ in range(6):
        mean = np.average(each, weights=weight)
        aside = offset - np.average(offset, weights=weight)
        spread = max(np.sum(weight * aside**2), 1e-300)
        slope = np.sum(weight * aside * each) / spread
        left = each - mean - slope * aside
        error = np.sqrt(np.sum((weight * left) ** 2)) / np.sum(weight)
        slope_error = np.sqrt(np.sum((weight * aside * left) ** 2)) / spread
        found = (float(mean), float(error)), (float(slope), float(slope_error))
        size = np.abs(left) * np.sqrt(weight)
        limit = 2.0 * np.median(size) + 1e-12
        weight = weight * np.minimum(1.0, limit / np.maximum(size, 1e-12))
    return found


def _counted(alike: int, value: float, error: float, least: float) -> int:
    """Return how many windows in a row are surely off, with the sign of the value."""
    sure = abs(value) > max(least, SURE * error)
    side = int(np.sign(value)) if sure else 0
    return side + (alike if alike * side > 0 else 0)
