"""Instants of step 0 on the lidar's clock, finer than its whole milliseconds."""

from dataclasses import dataclass

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_driver.clock.arrivals import WINDOW_MS
from nodlidar_driver.clock.stamp_check import IRREGULAR_MS, SPEED_RANGE
import numpy as np

_WANDER_MS = 0.05  # deviation of the motor from an even revolution that still fits
_MANY = 256  # scans, from which on it saves time to leave out those that bound no line
_BESIDE = 32  # scans of which only the outermost may bound one
_TRIAL_PERIODS = np.linspace(-1.0, 1.0, 65)[:, None]


@dataclass(frozen=True, slots=True)
class EvenTimes:
    """Evenly spaced instants: ``time + period * k`` with k <= 0, the newest at k = 0."""

    time: float
    period: float


def fit_truncated(revolutions: Integers, stamps: Integers, tolerance: float) -> EvenTimes | None:
    """Fit evenly spaced instants to truncated stamps.

    The instant of each stamp s is in [s, s + 1). The lines that satisfy all stamps form a polygon
    in the plane of time and period. Its centre is returned: the posterior mean under a flat prior.

    Parameters
    ----------
    revolutions
        Number k of the instant of each stamp, shape (n,), n >= 2, ascending to 0.
    stamps
        The truncated instants, shape (n,), relative to the newest one.
    tolerance
        By how much an instant may be outside of its interval, at either end; at least 0.02, since
        the trial periods would miss a narrower polygon.

    Returns
    -------
    EvenTimes or None
        None if no line satisfies all stamps.
    """
    span = -float(revolutions[0])
    widest = (1.0 + 2.0 * tolerance) / span
    periods = -float(stamps[0]) / span + widest * _TRIAL_PERIODS
    if len(stamps) > _MANY:
        bounding = _bounding(
            revolutions, stamps - periods[len(periods) // 2] * revolutions, widest
        )
        revolutions, stamps = revolutions[bounding], stamps[bounding]
    starts = stamps - periods * revolutions
    earliest = starts.max(axis=1) - tolerance
    latest = starts.min(axis=1) + 1.0 + tolerance
    weights = np.maximum(latest - earliest, 0.0)
    if not weights.any():
        return None
    weights /= weights.sum()
    return EvenTimes(float(weights @ (earliest + latest)) / 2.0, float(weights @ periods[:, 0]))


def _bounding(revolutions: Integers, starts: Array, widest: float) -> Mask:
    """Return which starts may be the first or the last one, with a period up to widest off.

    The others are farther within the starts of the scans beside them, by more than the period can
    move them against each other.
    """
    first = np.arange(0, len(starts), _BESIDE)
    last = np.minimum(first + _BESIDE, len(starts)) - 1
    slack = widest * (revolutions[last] - revolutions[first]) + 1e-9  # and the rounding
    low = np.minimum.reduceat(starts, first) + slack
    high = np.maximum.reduceat(starts, first) - slack
    group = np.arange(len(starts)) // _BESIDE
    return np.asarray((starts <= low[group]) | (starts >= high[group]))


def even_times(stamps: Array, period: float) -> Array:
    """Return evenly spaced instants for truncated stamps.

    Like :func:`fit_truncated`, but with a known period. Stamps that are not even are returned
    unchanged.

    Parameters
    ----------
    stamps
        The truncated instants, shape (n,), n >= 1.
    period
        Spacing of the instants; some instants may be missing.
    """
    revolutions = np.rint((stamps - stamps[0]) / period)
    phases = stamps - period * revolutions
    earliest, latest = phases.max(), phases.min() + 1.0
    if earliest > latest + 2.0 * _WANDER_MS:
        return stamps
    return np.asarray((earliest + latest) / 2.0 + period * revolutions)


class RevolutionTimes:
    """Times of step 0 from the stamps of a stream of scans.

    The device truncates the time of step 0 to whole milliseconds, but the revolutions are even: a
    line through the last scans gives the fraction, to 0.1 ms or better as soon as the fractions
    have covered a millisecond. If a revolution takes exactly a whole number of milliseconds, they
    never do; then the middle of the millisecond is returned.

    Parameters
    ----------
    period_ms
        Nominal time of one revolution [ms].

    Attributes
    ----------
    period_ms
        Time of one revolution as measured [ms].
    """

    def __init__(self, period_ms: float) -> None:
        self.period_ms = period_ms
        self._nominal_ms = period_ms
        # As many as in the window of the arrivals, in which times of other fits look like a drift:
        # fractions of a UST, whose revolutions take 25.004 ms, need 7 s to cover a millisecond.
        self._scans = round(WINDOW_MS / period_ms)
        # The last scans that fit one line.
        self._revolutions: Integers = np.empty(0, dtype=np.int64)
        self._stamps: Integers = np.empty(0, dtype=np.int64)

    def add(self, stamp_ms: int) -> Array:
        """Add the next scan's stamp (without wraps, ascending).

        Returns
        -------
        NDArray
            Times of step 0 [ms] of as many of the last scans as fit one line, this one last,
            shape (n,), n >= 1.
        """
        revolutions = self._revolutions_to(stamp_ms)
        if not self._regular(stamp_ms, revolutions):
            self._restart(stamp_ms, revolutions)
        last = self._revolutions[-1] if len(self._revolutions) else -1
        self._revolutions = np.concatenate([self._revolutions, [last + revolutions]])[
            -self._scans :
        ]
        self._stamps = np.concatenate([self._stamps, [stamp_ms]])[-self._scans :]
        if len(self._stamps) == 1:
            return np.array([stamp_ms + 0.5])
        return stamp_ms + self._fit()

    def _regular(self, stamp_ms: int, revolutions: int) -> bool:
        if not len(self._stamps):
            return True
        deviation = abs(stamp_ms - self._stamps[-1] - revolutions * self.period_ms)
        return bool(deviation <= IRREGULAR_MS * revolutions)

    def _revolutions_to(self, stamp_ms: int) -> int:
        if not len(self._stamps):
            return 1
        return max(round(float(stamp_ms - self._stamps[-1]) / self.period_ms), 1)

    def _restart(self, stamp_ms: int, revolutions: int) -> None:
        """Forget the scans so far; the motor may have a new speed."""
        period_ms = (stamp_ms - self._stamps[-1]) / revolutions
        if abs(period_ms - self._nominal_ms) < SPEED_RANGE * self._nominal_ms:
            self.period_ms = period_ms
        self._revolutions, self._stamps = self._revolutions[:0], self._stamps[:0]

    def _fit(self) -> Array:
        """Fit a line to as many scans as possible; return times after the newest stamp [ms]."""
        while True:
            revolutions = self._revolutions - self._revolutions[-1]
            stamps = self._stamps - self._stamps[-1]
            even = fit_truncated(revolutions, stamps, _WANDER_MS)
            if even is not None:
                self.period_ms = even.period
                return np.asarray(even.time + even.period * revolutions)
            oldest = max(len(revolutions) // 4, 1)
            self._revolutions, self._stamps = self._revolutions[oldest:], self._stamps[oldest:]
