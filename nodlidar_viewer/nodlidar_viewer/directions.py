"""A picture of the directions in which the sensor has lately seen something."""

from collections import deque

from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray

STEP = np.radians(1.5)  # side of a cell [rad]
HIGHEST = np.radians(60.0)  # elevation at the top of the picture; what is beyond is not in it
SPAN_NS = 10 * NS_PER_S  # for which a direction counts as seen
_COLUMNS, _ROWS = round(2.0 * np.pi / STEP), round(2.0 * HIGHEST / STEP)
_UNSEEN, _OLD, _NEW = np.array([[60, 20, 30], [40, 90, 60], [120, 255, 160]])


class Directions:
    """Remembers when each direction was seen last.

    Directions count from the nod axis: azimuth to the left, elevation up.
    """

    def __init__(self) -> None:
        self._seen: deque[tuple[int, NDArray[np.intp]]] = deque()

    def add(self, stamp_ns: int, points: NDArray[np.float32]) -> None:
        """Add a cloud: stamp [ns], points in the frame of the nod axis [m], shape (n, 3)."""
        if self._seen and stamp_ns < self._seen[-1][0]:
            self._seen.clear()  # time went back
        azimuth = np.arctan2(points[:, 1], points[:, 0])
        elevation = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1]))
        column = np.minimum(((np.pi - azimuth) / STEP).astype(np.intp), _COLUMNS - 1)
        row = np.floor((HIGHEST - elevation) / STEP).astype(np.intp)
        within = (row >= 0) & (row < _ROWS)
        self._seen.append((stamp_ns, np.unique((row * _COLUMNS + column)[within])))
        while stamp_ns - self._seen[0][0] > SPAN_NS:
            self._seen.popleft()

    def clear(self) -> None:
        """Forget all directions."""
        self._seen.clear()

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture, shape (rows, columns, 3): bright if seen just now, red if not.

        The middle is ahead, and left is left.
        """
        colours = np.tile(_UNSEEN, (_ROWS * _COLUMNS, 1))
        for stamp_ns, cells in self._seen:
            share = 1.0 - (self._seen[-1][0] - stamp_ns) / SPAN_NS
            colours[cells] = _OLD + share * (_NEW - _OLD)
        return colours.reshape(_ROWS, _COLUMNS, 3).astype(np.uint8)
