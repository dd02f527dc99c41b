"""Scans that repeat the ranges of the one before, as of a driver that hangs but still sends."""

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_common.arrays import Array
from nodlidar_common.errors import ScanError
import numpy as np
from numpy.typing import NDArray

# Fewer ranges than these may repeat by chance. If every second one did, all of these would once in
# a million scans.
_FEWEST = 20
# After this many scans in a row with the same ranges and pitch, the sensor rests.
_RESTING = 10


class RepeatedScanError(ScanError):
    """A scan has the ranges of another pitch."""

    def __init__(self) -> None:
        super().__init__('the same ranges as before, though the pitch is another')


class RepeatCheck:
    """Compares the ranges of each scan with those of the scan before.

    No two scans of many ranges are equal to the last bit, unless the lidar and all around it stand
    still. It may have come to rest at another pitch than was estimated for the first of them.
    """

    def __init__(self) -> None:
        self._ranges, self._pitch = b'', np.empty(0)
        self._latest, self._same = self._pitch, 0  # pitch that does not change, for so many scans

    def check(self, geometry: ScanGeometry, ranges: NDArray[np.float32], pitch: Array) -> None:
        """Raise RepeatedScanError for ranges (n,) of before, if the pitch (n,) is not.

        The pitch is another if it differs by more than the angle between two beams.
        """
        content = ranges.tobytes()
        if content != self._ranges or len(pitch) != len(self._pitch):
            self._ranges, self._pitch = content, pitch
            self._latest, self._same = pitch, 0
            return
        limit = abs(geometry.angle_increment)
        self._same += 1
        if np.abs(pitch - self._latest).max() > limit / 2.0:
            self._latest, self._same = pitch, 0
        elif self._same >= _RESTING:
            self._pitch = pitch
        is_another = np.abs(pitch - self._pitch).max() > limit
        if is_another and np.count_nonzero(geometry.measured(ranges)) >= _FEWEST:
            raise RepeatedScanError
