"""Scans that come at another rate than their beams."""

from collections import deque
from statistics import median

from nodlidar_common.stamps import NS_PER_S

WINDOW = 100  # scans
FEWEST = 30
OFF = 0.05  # share by which the time of a revolution may be wrong


class ScanRate:
    """Compares the time from scan to scan with that of a revolution by `time_increment`.

    Scans may be missing: their stamps are a whole number of revolutions apart. The median counts,
    so single wrong stamps, gaps and restarts do not.
    """

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._steps: deque[tuple[float, float]] = deque(maxlen=WINDOW)

    def add(self, stamp_ns: int, nominal: float) -> None:
        """Add a scan.

        Parameters
        ----------
        stamp_ns
            Its stamp [ns].
        nominal
            Time of a revolution [s] that it states; 0 if it states none.
        """
        last_ns, self._last_ns = self._last_ns, stamp_ns
        if last_ns is not None and stamp_ns > last_ns and nominal > 0.0:
            self._steps.append(((stamp_ns - last_ns) / NS_PER_S, nominal))

    @property
    def warning(self) -> str:
        """By how much `time_increment` contradicts the stamps; empty if it does not."""
        if len(self._steps) < FEWEST:
            return ''
        ratios = [step / nominal for step, nominal in self._steps]
        off = median(ratio / max(round(ratio), 1) for ratio in ratios)
        if abs(off - 1.0) <= OFF:
            return ''
        step, nominal = (median(each) for each in zip(*self._steps, strict=True))
        return (
            f'scans come every {step * 1e3:.0f} ms, but a revolution takes {nominal * 1e3:.0f} ms '
            'by their time_increment: one of them is wrong'
        )
