"""The points of the latest clouds, in chunks that a page draws one by one."""

from dataclasses import dataclass

from nodlidar_common.stamps import NS_PER_S
import numpy as np
from numpy.typing import NDArray

CHUNK_NS = NS_PER_S // 2  # a new chunk begins after this time


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """Points of about half a second, or of one cloud that is longer.

    Attributes
    ----------
    number
        Counts the chunks.
    begin_ns
        Stamp of the first cloud [ns].
    points
        In the fixed frame [m], shape (n, 3).
    """

    number: int
    begin_ns: int
    points: NDArray[np.float32]


class RecentPoints:
    """Keeps the points of the latest clouds.

    Parameters
    ----------
    most_points
        Number of points that are kept, at most; the oldest chunks go first.

    Attributes
    ----------
    chunks
        The oldest first; replaced as a whole, so that another thread may read it.
    """

    def __init__(self, most_points: int) -> None:
        self._most_points = most_points
        self._next = 0
        self.chunks: tuple[Chunk, ...] = ()

    def add(self, stamp_ns: int, points: NDArray[np.float32]) -> None:
        """Add a cloud: stamp [ns], points in the fixed frame [m], shape (n, 3).

        A stamp before that of the last chunk means that time went back: all others are forgotten.
        """
        before = self.chunks
        if before and stamp_ns < before[-1].begin_ns:
            before = ()
        if before and stamp_ns - before[-1].begin_ns < CHUNK_NS:
            before, last = before[:-1], before[-1]
            newest = Chunk(last.number, last.begin_ns, np.concatenate([last.points, points]))
        else:
            newest = Chunk(self._next, stamp_ns, points)
            self._next += 1
        chunks = (*before, newest)
        count = sum(len(chunk.points) for chunk in chunks)
        while len(chunks) > 1 and count > self._most_points:
            count -= len(chunks[0].points)
            chunks = chunks[1:]
        self.chunks = chunks

    def clear(self) -> None:
        """Forget all points."""
        self.chunks = ()

    @property
    def count(self) -> int:
        """Number of points."""
        return sum(len(chunk.points) for chunk in self.chunks)

    @property
    def points(self) -> NDArray[np.float32]:
        """All points, shape (n, 3)."""
        empty = np.empty((0, 3), dtype=np.float32)
        return np.concatenate([empty, *(chunk.points for chunk in self.chunks)])
