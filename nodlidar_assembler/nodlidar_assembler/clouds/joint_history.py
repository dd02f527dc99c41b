"""The joint samples of the last seconds, in ascending time."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import NamedTuple

from nodlidar_common.arrays import Array, Times
from nodlidar_common.parameters import parameter
from nodlidar_common.stamps import NS_PER_S
import numpy as np

SPAN_NS = 10 * NS_PER_S  # the longest deadline
MOST_SAMPLES = 20_000  # 10 s at 2 kHz; stamps may be arbitrarily close


class JointSamples(NamedTuple):
    """Stamps [ns], ascending, and positions [rad], both of shape (n,)."""

    time_ns: Times
    pitch: Array


@dataclass(frozen=True)
class JointSamplesConfig:
    """Joint samples."""

    max_joint_gap: float = parameter(
        0.1,
        'Longest time between joint samples to interpolate over',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )


class JointHistory:
    """Keeps joint samples; those with equal stamps in the order of arrival."""

    def __init__(self) -> None:
        self._times_ns: list[int] = []
        self._pitch: list[float] = []

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest sample [ns]; None if there is none."""
        return self._times_ns[-1] if self._times_ns else None

    def add(self, time_ns: int, pitch: float) -> None:
        """Add a sample [ns], [rad]; keep SPAN_NS before the newest, at most MOST_SAMPLES."""
        place = bisect_right(self._times_ns, time_ns)
        self._times_ns.insert(place, time_ns)
        self._pitch.insert(place, pitch)
        old = bisect_left(self._times_ns, self._times_ns[-1] - SPAN_NS)
        old = max(old, len(self._times_ns) - MOST_SAMPLES)
        del self._times_ns[:old], self._pitch[:old]

    def clear(self) -> None:
        """Forget all samples."""
        self._times_ns.clear()
        self._pitch.clear()

    def before(self, time_ns: int) -> int | None:
        """Return the time of the last sample at or before an instant [ns]; None without one."""
        place = bisect_right(self._times_ns, time_ns)
        return self._times_ns[place - 1] if place else None

    def after(self, time_ns: int) -> int | None:
        """Return the time of the first sample at or after an instant [ns]; None without one."""
        place = bisect_left(self._times_ns, time_ns)
        return self._times_ns[place] if place < len(self._times_ns) else None

    def between(self, begin_ns: int, end_ns: int) -> JointSamples:
        """Return the samples from one instant to another [ns], both inclusive."""
        chosen = slice(bisect_left(self._times_ns, begin_ns), bisect_right(self._times_ns, end_ns))
        return JointSamples(
            np.array(self._times_ns[chosen], dtype=np.int64),
            np.array(self._pitch[chosen], dtype=np.float64),
        )
