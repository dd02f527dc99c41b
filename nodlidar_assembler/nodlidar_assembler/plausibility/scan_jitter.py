"""Stamps of scans that jitter, as those of arrival over a network or at a busy computer."""

from collections import deque

from nodlidar_assembler.plausibility.point_error import DISTANCE, LEAST_ERROR
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S
import numpy as np

WINDOW = 100  # scans
FEWEST = 30
_OFF = 0.3  # share by which a time between two scans may be off the period
_TO_RMS = 1.4826  # of a normal distribution, by the median of its absolute value


class ScanJitter:
    """Compares the stamps of scans with those of a lidar that turns evenly.

    From scan to scan a lidar keeps its speed, even if that wanders: the times between three scans
    differ by the jitter alone. The median of these differences counts, so single wrong stamps,
    gaps and restarts do not.
    """

    def __init__(self) -> None:
        self._scans: deque[tuple[int, float]] = deque(maxlen=WINDOW)
        self._nominal = 0.0

    def add(self, stamp_ns: int, nominal: float, pitch: float) -> None:
        """Add a scan.

        Parameters
        ----------
        stamp_ns
            Its stamp [ns].
        nominal
            Time of a revolution [s] that it states; 0 if it states none.
        pitch
            The latest when it came [rad].
        """
        self._scans.append((stamp_ns, pitch))
        self._nominal = nominal

    @property
    def warning(self) -> str:
        """By how much stamps jitter; empty if points are off by no more than LEAST_ERROR."""
        if len(self._scans) < FEWEST:
            return ''
        stamps_ns, pitch = (np.array(each) for each in zip(*self._scans, strict=True))
        steps = np.abs(np.diff(stamps_ns)) / NS_PER_S
        period = self._period(steps)
        uneven = np.diff(steps - np.rint(steps / period) * period)
        jitter = _TO_RMS * float(np.median(np.abs(uneven))) / 6.0**0.5
        speed = float(np.median(np.abs(np.diff(pitch)) / np.maximum(steps, period)))
        error = jitter * speed * DISTANCE
        if error <= LEAST_ERROR:
            return ''
        return (
            f'stamps of scans jitter by {jitter * 1e3:.0f} ms RMS, so points {DISTANCE:g} m away '
            f'are {error * 1e3:.0f} mm off: stamp each scan when its first beam is measured'
        )

    def _period(self, steps: Array) -> float:
        """Return the time [s] from scan to scan; where scans are missing it is a part of it."""
        nominal = self._nominal or float(np.percentile(steps, 10))
        single = steps[np.abs(steps - nominal) <= _OFF * nominal]
        return max(float(np.median(single if len(single) else steps)), 1.0 / NS_PER_S)
