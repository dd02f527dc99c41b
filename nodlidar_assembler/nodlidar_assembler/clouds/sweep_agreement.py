"""Whether the way up and the way down see the same: a wrong delay moves them apart.

In a small cell of azimuth and pitch the range is about ``a + b phi + c theta``. A delay d of the
joint states shifts phi by d times the speed, up on the way up and down on the way down. So with a
term ``g speed`` fitted beside the others, ``d = g / b`` in every cell where the range depends on
the pitch. Where people walk or the robot moves, cells disagree: their scatter is the error of d.
"""

from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW = 20.0  # in which a static scene is assumed [s]
EVERY = 4  # beams
AZIMUTH_CELL, PITCH_CELL = 0.1, 0.1  # [rad]
LEAST_DELAY = 3e-3  # that is reported [s]
SURE = 6.0  # standard errors
CONFIRMED = 3  # windows, one after the other, with the same sign
_LEAST_IN_CELL, _LEAST_CELLS = 12, 20
_FARTHEST = 2.0  # pitch of a cell, at most [rad]
_TERMS = 5  # 1, pitch, azimuth, speed, range


class SweepAgreement:
    """Estimates the delay of joint states, window by window; costs some 0.1 ms per scan.

    Attributes
    ----------
    delay, error
        Of the last window: additional delay and its standard error [s]; NaN if it is unknown.
    """

    def __init__(self) -> None:
        self.delay = self.error = float('nan')
        self._cells: tuple[int, int] = (64, round(2.0 * _FARTHEST / PITCH_CELL))
        self._alike = 0
        self._start_ns: int | None = None
        self._clear()

    @property
    def warning(self) -> str:
        """What to do if the delay is off for several windows; else empty."""
        if abs(self._alike) < CONFIRMED:
            return ''
        return (
            f'up and down sweeps disagree: joint_delay is off by {self.delay * 1e3:.1f} ms; '
            'run calibrate'
        )

    def restart(self) -> None:
        """Forget the window, as after the clock was set."""
        self._start_ns, self._alike = None, 0
        self._clear()

    def add(self, assembled: Assembled) -> None:
        """Add a scan; ends a window if it is full."""
        stamp_ns = assembled.scan.stamp_ns
        if self._start_ns is None or stamp_ns < self._start_ns:
            self._start_ns = stamp_ns
        if stamp_ns - self._start_ns > WINDOW * NS_PER_S:
            self._end()
            self._start_ns = stamp_ns
        self._gather(assembled)

    def _clear(self) -> None:
        self._sums = np.zeros((self._cells[0] * self._cells[1], _TERMS * _TERMS))

    def _gather(self, assembled: Assembled) -> None:
        chosen = assembled.placed.beams[::EVERY]
        beams = assembled.beams
        if len(chosen) < 2 or beams.geometry.time_increment == 0.0:
            return
        pitch, azimuth = assembled.pitch[chosen], beams.azimuth[chosen]
        speed = np.gradient(pitch, beams.offset[chosen])
        column = np.floor(azimuth / AZIMUTH_CELL).astype(np.int64) % self._cells[0]
        row = np.floor((pitch + _FARTHEST) / PITCH_CELL).astype(np.int64)
        inside = (row >= 0) & (row < self._cells[1]) & (np.abs(speed) > 0.1)
        ranges = assembled.scan.ranges[chosen].astype(np.float64)
        off = pitch - (row + 0.5) * PITCH_CELL + _FARTHEST
        aside = azimuth - (np.floor(azimuth / AZIMUTH_CELL) + 0.5) * AZIMUTH_CELL
        terms = np.stack([np.ones_like(off), off, aside, speed, ranges], axis=1)[inside]
        products = (terms[:, :, None] * terms[:, None, :]).reshape(len(terms), _TERMS**2)
        np.add.at(self._sums, (column * self._cells[1] + row)[inside], products)

    def _end(self) -> None:
        """Estimate the delay of the window, and count the windows that agree on one."""
        self.delay, self.error = _delay(self._sums.reshape(-1, _TERMS, _TERMS))
        sure = abs(self.delay) > max(LEAST_DELAY, SURE * self.error)
        side = int(np.sign(self.delay)) if sure else 0
        self._alike = side + (self._alike if self._alike * side > 0 else 0)
        self._clear()


def _delay(moments: Array) -> tuple[float, float]:
    """Return the delay [s] from the moments of cells (c, 5, 5), and its standard error."""
    used = moments[moments[:, 0, 0] >= _LEAST_IN_CELL]
    used = used[np.linalg.cond(used[:, :4, :4]) < 1e8] if len(used) else used
    if len(used) < _LEAST_CELLS:
        return float('nan'), float('nan')
    fit = np.linalg.solve(used[:, :4, :4], used[:, :4, 4:])[..., 0]
    rest = used[:, 4, 4] - np.einsum('ck,ck->c', fit, used[:, :4, 4])
    variance = np.maximum(rest / (used[:, 0, 0] - 4.0), 1e-6)
    inverse = np.linalg.inv(used[:, :4, :4])
    weight = fit[:, 1] ** 2 / (variance * inverse[:, 3, 3])
    each = fit[:, 3] / np.where(np.abs(fit[:, 1]) > 1e-3, fit[:, 1], np.inf)
    kept = np.abs(fit[:, 1]) > 3.0 * np.sqrt(variance * inverse[:, 1, 1])
    if kept.sum() < _LEAST_CELLS:
        return float('nan'), float('nan')
    weight, each = weight[kept], each[kept]
    for _ in range(5):
        mean = np.average(each, weights=weight)
        size = np.abs(each - mean) * np.sqrt(weight)
        limit = 2.0 * np.median(size) + 1e-12
        weight = weight * np.minimum(1.0, limit / np.maximum(size, 1e-12))
    mean = np.average(each, weights=weight)
    error = np.sqrt(np.sum((weight * (each - mean)) ** 2)) / np.sum(weight)
    return float(mean), float(error)
