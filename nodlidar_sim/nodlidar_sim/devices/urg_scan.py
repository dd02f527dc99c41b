"""One revolution of an emulated URG-04LX: its beams, and the lines that carry them."""

from dataclasses import dataclass

from nodlidar_common import scip
from nodlidar_sim.world.effects import Measure
import numpy as np
from numpy.typing import NDArray

STEPS_PER_REVOLUTION = 1024
FIRST_STEP, LAST_STEP, FRONT_STEP = 44, 725, 384
LAST_REQUESTABLE_STEP = 768
MIN_RANGE_MM, MAX_RANGE_MM = 20, 5600
NOTHING_IN_RANGE, NEIGHBOURS_IN_ERROR, NOT_MEASURABLE = 0, 7, 19

_STEPS = np.arange(FIRST_STEP, LAST_STEP + 1)
_STEP_ANGLE = 2.0 * np.pi / STEPS_PER_REVOLUTION
_AZIMUTHS = np.asarray((_STEPS - FRONT_STEP) * _STEP_ANGLE, dtype=np.float64)
_SHORT_MAX = 64**2 - 1


class Revolution:
    """The beams of one revolution.

    Parameters
    ----------
    start_ns
        Host time of step 0 [ns].
    end_ns
        Host time of step 0 of the next revolution [ns].
    timer
        Reading of the sensor's timer at step 0 [ms].

    Attributes
    ----------
    codes
        Range [mm] or error code of each step that can be requested, shape (769,).
    measured
        Whether the codes have been measured.
    times_ns
        Time of each beam [ns], shape (682,).
    """

    def __init__(self, start_ns: int, end_ns: int, timer: int) -> None:
        self.start_ns = start_ns
        self.end_ns = end_ns
        self.timer = timer
        self.codes = np.full(LAST_REQUESTABLE_STEP + 1, NOT_MEASURABLE, dtype=np.int64)
        self.measured = False
        elapsed = _STEPS * ((end_ns - start_ns) / STEPS_PER_REVOLUTION)
        self.times_ns = start_ns + np.rint(elapsed).astype(np.int64)

    @property
    def last_beam_ns(self) -> int:
        """Time of the last beam [ns]."""
        return int(self.times_ns[-1])

    def measure(self, measure: Measure) -> None:
        """Measure every beam at its own instant."""
        self.codes[_STEPS] = range_codes(measure(self.times_ns, _AZIMUTHS))
        self.measured = True


@dataclass(frozen=True, slots=True)
class ScanRequest:
    """The steps to send, and their format.

    Attributes
    ----------
    first, last
        Steps, both included.
    cluster
        Number of steps sent as one value, the least of them.
    characters
        For each value, 2 or 3.
    """

    first: int
    last: int
    cluster: int
    characters: int

    def lines(self, revolution: Revolution) -> list[bytes]:
        """Return the timer line and the data lines of a message."""
        values = clustered(revolution.codes[self.first : self.last + 1], self.cluster)
        if self.characters == 2:
            values = np.minimum(values, _SHORT_MAX)
        timer = scip.add_sum(scip.encode([revolution.timer], 4))
        return [timer, *scip.split_blocks(scip.encode(values, self.characters))]


def range_codes(ranges: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return ranges [m] in whole millimetres, or as error codes below 20."""
    millimetres = np.rint(1000.0 * ranges)
    codes = np.where(millimetres <= MAX_RANGE_MM, millimetres, NOTHING_IN_RANGE)
    codes = np.where(millimetres < MIN_RANGE_MM, NOT_MEASURABLE, codes)
    return np.where(np.isnan(ranges), NEIGHBOURS_IN_ERROR, codes).astype(np.int64)


def clustered(codes: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Return the least range of each group of steps, or its first error code if it has no range.

    Parameters
    ----------
    codes
        Ranges [mm] and error codes, shape (n,).
    size
        Steps in a group; 0 counts as 1. The last group may be smaller.
    """
    if size <= 1:
        return codes
    starts = np.arange(0, len(codes), size)
    least = np.minimum.reduceat(np.where(codes < MIN_RANGE_MM, MAX_RANGE_MM + 1, codes), starts)
    return np.where(least > MAX_RANGE_MM, codes[starts], least)
