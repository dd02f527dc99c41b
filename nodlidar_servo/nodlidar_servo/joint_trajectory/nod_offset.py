"""How far above the nod a joint is measured, on its way up and down alike."""

import math

from nodlidar_common.nod import Nod
from nodlidar_common.phase import lateness, longest_lateness, Pitched

LEAST = 0.05
"""An offset below [rad] may be that of a servo under load."""

_GAIN = 0.05  # weight of a sample
_FEWEST = 60  # samples in each direction: 1.2 s of both at 100 Hz, and reversals


class NodOffset:
    """Tells by how much joint states are off the nod that was sent.

    A joint that is late is below the nod on its way up, and above it on its way down. One whose
    zero is another one is above, or below, on both.

    Attributes
    ----------
    radians
        The offset, positive up; 0 unless it is more than LEAST.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget all measurements: the joint is not on the nod."""
        self._means, self._counts = [0.0, 0.0], [0, 0]

    def add(self, nod: Nod, sample: Pitched, cruise: float) -> None:
        """Add a measurement; parameters as in :func:`nodlidar_common.phase.lateness`."""
        late = lateness(nod, sample, cruise)
        if late is None:
            return
        if abs(late) > longest_lateness(nod):
            self.restart()
            return
        down = math.floor(nod.sweep_at(sample.stamp_ns)) % 2
        off = (late if down else -late) * cruise
        self._counts[down] += 1
        self._means[down] += max(_GAIN, 1.0 / self._counts[down]) * (off - self._means[down])

    @property
    def radians(self) -> float:  # noqa: D102
        offset = sum(self._means) / 2.0
        return offset if min(self._counts) >= _FEWEST and abs(offset) > LEAST else 0.0
