"""The time between joint samples when none is missing."""

from nodlidar_common.nod import NS_PER_S
import numpy as np
from numpy.typing import NDArray

_REMEMBERED = 100
_SHORTER = 4  # one in so many is shorter than the usual one


class UsualGap:
    """Learns how far apart joint samples are, also while many of them are missing or late.

    Missing samples make gaps longer, never shorter, so the usual gap is one of the short ones of
    the last hundred. A joint whose rate changes has another one some 75 samples later.
    """

    def __init__(self) -> None:
        self._gaps: NDArray[np.float64] = np.empty(0)
        self._last_ns: int | None = None

    def add(self, sample_ns: NDArray[np.int64]) -> float:
        """Take stamps of joint samples [ns], ascending, known ones too; return the usual gap [s].

        It is infinite as long as there is none.
        """
        new = sample_ns
        if self._last_ns is not None and len(new) and new[0] <= self._last_ns <= new[-1]:
            new = new[new >= self._last_ns]
        if len(new):
            self._last_ns = int(new[-1])
            gaps = (new[1:] - new[:-1]) / NS_PER_S
            self._gaps = np.concatenate((self._gaps, gaps))[-_REMEMBERED:]
        place = len(self._gaps) // _SHORTER
        return float(np.partition(self._gaps, place)[place]) if len(self._gaps) else np.inf
