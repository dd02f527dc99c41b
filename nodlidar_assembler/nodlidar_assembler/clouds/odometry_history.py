"""The odometry samples of the last seconds."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence

from nodlidar_assembler.clouds.ego_motion import Odometry, Poses
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S
import numpy as np

SPAN_NS = 10 * NS_PER_S  # as long as TF keeps transforms
MOST_SAMPLES = 20_000  # 10 s at 2 kHz; stamps may be arbitrarily close


class OdometryHistory:
    """Keeps samples of a frame's pose; ignores those that are not newer than the last.

    Parameters
    ----------
    mount
        Pose in that frame of the frame whose odometry `around` returns; None if it is the same.
    """

    def __init__(self, mount: Pose | None = None) -> None:
        self._mount = mount
        self._times_ns: list[int] = []
        self._positions: list[Sequence[float]] = []
        self._orientations: list[Sequence[float]] = []

    @property
    def oldest_ns(self) -> int | None:
        """Time of the oldest sample [ns]; None if there is none."""
        return self._times_ns[0] if self._times_ns else None

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest sample [ns]; None if there is none."""
        return self._times_ns[-1] if self._times_ns else None

    def add(self, time_ns: int, position: Sequence[float], orientation: Sequence[float]) -> None:
        """Add a sample: time [ns], x y z [m], quaternion x y z w."""
        if self._times_ns and time_ns <= self._times_ns[-1]:
            return
        self._times_ns.append(time_ns)
        self._positions.append(position)
        self._orientations.append(orientation)
        old = bisect_left(self._times_ns, time_ns - SPAN_NS)
        self._forget(max(old, len(self._times_ns) - MOST_SAMPLES))

    def clear(self) -> None:
        """Forget all samples."""
        self._forget(len(self._times_ns))

    def around(self, begin_ns: int, end_ns: int) -> Odometry:
        """Return the samples, at least two, that bracket an interval [ns] most closely.

        Raises
        ------
        OdometryError
            If one of them is not a valid pose.
        """
        first = bisect_right(self._times_ns, begin_ns) - 1
        first = max(min(first, len(self._times_ns) - 2), 0)  # two, also if it begins at the last
        chosen = slice(first, max(bisect_left(self._times_ns, end_ns) + 1, first + 2))
        position = np.array(self._positions[chosen], dtype=np.float64).reshape(-1, 3)
        orientation = np.array(self._orientations[chosen], dtype=np.float64).reshape(-1, 4)
        time_ns = np.array(self._times_ns[chosen], dtype=np.int64)
        odometry = Odometry(time_ns, Poses(position, orientation))
        return odometry if self._mount is None else odometry.mounted(self._mount)

    def _forget(self, count: int) -> None:
        for samples in (self._times_ns, self._positions, self._orientations):
            del samples[:count]
