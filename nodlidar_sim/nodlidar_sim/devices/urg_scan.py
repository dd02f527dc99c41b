"""One revolution of an emulated URG-04LX: its beams, and the lines that carry them."""

from dataclasses import dataclass

from nodlidar_common import scip
from nodlidar_common.arrays import Array, Integers
from nodlidar_sim.devices.scip_models import ScipModel, URG_04LX_UG01
from nodlidar_sim.world.effects import Measure
import numpy as np

NOT_MEASURABLE = 19

_SHORT_MAX = 64**2 - 1
_FARTHEST = 65535  # mm, of any model


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
    model
        Layout of its beams.

    Attributes
    ----------
    codes
        Range [mm] or error code of each step that can be requested, shape (n,).
    measured
        Whether the codes have been measured.
    times_ns
        Time of each measured beam [ns], shape (n,).
    """

    def __init__(
        self, start_ns: int, end_ns: int, timer: int, model: ScipModel = URG_04LX_UG01
    ) -> None:
        self.start_ns = start_ns
        self.end_ns = end_ns
        self.timer = timer
        self._model = model
        self.codes = np.full(model.last_requestable + 1, NOT_MEASURABLE, dtype=np.int64)
        self.measured = False
        elapsed = model.steps * ((end_ns - start_ns) / model.steps_per_revolution)
        self.times_ns = start_ns + np.rint(elapsed).astype(np.int64)

    @property
    def range_min_mm(self) -> int:
        """Below it are error codes [mm]."""
        return self._model.range_min_mm

    @property
    def last_beam_ns(self) -> int:
        """Time of the last beam [ns]."""
        return int(self.times_ns[-1])

    def measure(self, measure: Measure) -> None:
        """Measure every beam at its own instant."""
        model = self._model
        ranges = measure(self.times_ns, model.azimuths)
        self.codes[model.steps] = range_codes(ranges, model)
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
        codes = revolution.codes[self.first : self.last + 1]
        values = clustered(codes, self.cluster, revolution.range_min_mm)
        if self.characters == 2:
            values = np.minimum(values, _SHORT_MAX)
        timer = scip.add_sum(scip.encode([revolution.timer], 4))
        return [timer, *scip.split_blocks(scip.encode(values, self.characters))]


def range_codes(ranges: Array, model: ScipModel = URG_04LX_UG01) -> Integers:
    """Return ranges [m] in whole millimetres, or as error codes."""
    millimetres = np.rint(1000.0 * ranges)
    codes = np.where(millimetres <= model.range_max_mm, millimetres, model.nothing)
    codes = np.where(millimetres < model.range_min_mm, NOT_MEASURABLE, codes)
    return np.where(np.isnan(ranges), model.lost, codes).astype(np.int64)


def clustered(
    codes: Integers, size: int, range_min_mm: int = URG_04LX_UG01.range_min_mm
) -> Integers:
    """Return the least range of each group of steps, or its first error code if it has no range.

    Parameters
    ----------
    codes
        Ranges [mm] and error codes, shape (n,).
    size
        Steps in a group; 0 counts as 1. The last group may be smaller.
    range_min_mm
        Below it are error codes [mm].
    """
    if size <= 1:
        return codes
    starts = np.arange(0, len(codes), size)
    least = np.minimum.reduceat(np.where(codes < range_min_mm, _FARTHEST + 1, codes), starts)
    return np.where(least > _FARTHEST, codes[starts], least)
