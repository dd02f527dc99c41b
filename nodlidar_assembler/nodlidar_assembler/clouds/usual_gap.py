"""The time between joint samples if none is missing."""

from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

_KEPT = 100
_SHORTER = 20  # one in so many is shorter than the usual gap


class UsualGap:
    """Estimates the time between joint samples, also while many of them are missing or late.

    Missing samples make gaps longer, never shorter, so the usual gap is among the shortest of the
    last hundred, even if most samples are missing. It follows a lower rate within 95 samples.
    """

    def __init__(self) -> None:
        self._gaps: NDArray[np.float64] = np.empty(0)
        self._last_ns: int | None = None

    def add(self, sample_ns: NDArray[np.int64]) -> float:
        """Add stamps of joint samples [ns], ascending; return the usual gap [s].

        Stamps may repeat earlier ones. The gap is infinite until there are two samples.
        """
        new = sample_ns
        if self._last_ns is not None and len(new) and new[0] <= self._last_ns <= new[-1]:
            new = new[new >= self._last_ns]
        if len(new):
            self._last_ns = int(new[-1])
            gaps = (new[1:] - new[:-1]) / NS_PER_S
            self._gaps = np.concatenate((self._gaps, gaps))[-_KEPT:]
        place = len(self._gaps) // _SHORTER
        return float(np.partition(self._gaps, place)[place]) if len(self._gaps) else np.inf
