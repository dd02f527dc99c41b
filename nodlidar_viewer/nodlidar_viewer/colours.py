"""Colours of points, by height and by age."""

from matplotlib import colormaps
import numpy as np
from numpy.typing import NDArray

Colours = NDArray[np.uint8]

LEAST_RANGE = 0.5  # of heights [m]
CHANGED = 0.2  # share of the range by which a limit must move for new colours
_HEIGHT = np.array(colormaps['turbo'](np.linspace(0.05, 0.95, 256))[:, :3] * 255.0, dtype=np.uint8)
_AGE = np.array(colormaps['plasma'](np.linspace(0.0, 0.9, 256))[:, :3] * 255.0, dtype=np.uint8)


class HeightColours:
    """Colours by height, from the lowest to the highest of the points."""

    def __init__(self) -> None:
        self._low, self._high = 0.0, LEAST_RANGE

    def fit(self, heights: NDArray[np.float32]) -> bool:
        """Adapt to heights [m], shape (n,); return whether the colours are others now."""
        if not len(heights):
            return False
        low, high = (float(h) for h in np.percentile(heights, (1.0, 99.0)))
        high = max(high, low + LEAST_RANGE)
        moved = max(abs(low - self._low), abs(high - self._high))
        if moved < CHANGED * (high - low):
            return False
        self._low, self._high = low, high
        return True

    def of(self, heights: NDArray[np.float32]) -> Colours:
        """Return the colours of heights [m], shape (n, 3)."""
        share = (heights - self._low) / (self._high - self._low)
        return _HEIGHT[np.clip(share * 255.0, 0.0, 255.0).astype(np.intp)]


def of_age(share: float) -> tuple[int, int, int]:
    """Return the colour of an age: 0 of the newest points, 1 of the oldest ones."""
    red, green, blue = _AGE[round(255.0 * (1.0 - min(max(share, 0.0), 1.0)))].tolist()
    return red, green, blue
