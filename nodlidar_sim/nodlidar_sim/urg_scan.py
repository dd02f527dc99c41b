"""One turn of an emulated URG-04LX: beams at their own instants, and what is sent of them."""

from dataclasses import dataclass

from nodlidar_common import scip
from nodlidar_sim.effects import Measure
import numpy as np
from numpy.typing import NDArray

STEPS_PER_TURN = 1024
FIRST_STEP, LAST_STEP, FRONT_STEP = 44, 725, 384
LAST_REQUESTABLE_STEP = 768
MIN_RANGE_MM, MAX_RANGE_MM = 20, 5600
NOTHING_IN_RANGE, NEIGHBOURS_IN_ERROR, NOT_MEASURABLE = 0, 7, 19

_CHUNK = 64  # steps measured at once: 6 ms, so that no event is late for a long computation
_SHORT_MAX = 64**2 - 1


class Turn:
    """The beams of one revolution, measured as time passes.

    Parameters
    ----------
    start_ns
        Host time of step 0 [ns].
    end_ns
        Host time of the next turn's step 0 [ns].
    timer
        The sensor's timer at step 0 [ms].

    Attributes
    ----------
    codes
        Range [mm] or error of each step that can be asked for, so far, shape (769,).
    """

    def __init__(self, start_ns: int, end_ns: int, timer: int) -> None:
        self.start_ns = start_ns
        self.end_ns = end_ns
        self.timer = timer
        self.codes = np.full(LAST_REQUESTABLE_STEP + 1, NOT_MEASURABLE, dtype=np.int64)
        self._step_ns = (end_ns - start_ns) / STEPS_PER_TURN
        self._next_step = FIRST_STEP

    @property
    def next_event_ns(self) -> int | None:
        """When the next beams can be measured [ns], or None after the last one."""
        if self._next_step > LAST_STEP:
            return None
        return int(self._times_ns(self._chunk()[-1:])[0])

    def measure(self, measure: Measure, now_ns: int) -> None:
        """Measure the beams that have been sent by now [ns]."""
        while (event := self.next_event_ns) is not None and event <= now_ns:
            steps = self._chunk()
            azimuth = (2.0 * np.pi / STEPS_PER_TURN) * (steps - FRONT_STEP).astype(np.float64)
            self.codes[steps] = range_codes(measure(self._times_ns(steps), azimuth))
            self._next_step = int(steps[-1]) + 1

    def _chunk(self) -> NDArray[np.int64]:
        return np.arange(self._next_step, min(self._next_step + _CHUNK, LAST_STEP + 1))

    def _times_ns(self, steps: NDArray[np.int64]) -> NDArray[np.int64]:
        times: NDArray[np.int64] = np.rint(steps * self._step_ns).astype(np.int64)
        return self.start_ns + times


@dataclass(frozen=True, slots=True)
class ScanRequest:
    """Which steps to send, and how.

    Attributes
    ----------
    first, last
        Steps, both included.
    cluster
        Steps that are sent as one value, their least.
    characters
        2 or 3 for each value.
    """

    first: int
    last: int
    cluster: int
    characters: int

    def lines(self, turn: Turn) -> list[bytes]:
        """Return the lines of a message that carry a turn: timer and data."""
        values = clustered(turn.codes[self.first : self.last + 1], self.cluster)
        if self.characters == 2:
            values = np.minimum(values, _SHORT_MAX)
        timer = scip.add_sum(scip.encode([turn.timer], 4))
        return [timer, *scip.split_blocks(scip.encode(values, self.characters))]


def range_codes(ranges: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return ranges [m] as whole millimetres, or as an error code below 20."""
    millimetres = np.rint(1000.0 * ranges)
    codes = np.where(millimetres <= MAX_RANGE_MM, millimetres, NOTHING_IN_RANGE)
    codes = np.where(millimetres < MIN_RANGE_MM, NOT_MEASURABLE, codes)
    return np.where(np.isnan(ranges), NEIGHBOURS_IN_ERROR, codes).astype(np.int64)


def clustered(codes: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Return the least range of each group of steps, or its first error if it has no range.

    Parameters
    ----------
    codes
        Ranges [mm] and errors, shape (n,).
    size
        Steps in a group; 0 counts as 1, the last group may be smaller.
    """
    if size <= 1:
        return codes
    starts = np.arange(0, len(codes), size)
    least = np.minimum.reduceat(np.where(codes < MIN_RANGE_MM, MAX_RANGE_MM + 1, codes), starts)
    return np.where(least > MAX_RANGE_MM, codes[starts], least)
