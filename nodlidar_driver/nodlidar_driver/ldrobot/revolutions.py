"""Sorts beams into revolutions, each with an even angle and time from beam to beam.

A revolution begins at the rear, so that the beams of a window ahead come one after the other.
"""

from dataclasses import dataclass
import math
from typing import NamedTuple

from nodlidar_common.errors import DeviceError
from nodlidar_common.ldrobot import POINTS, TIMER_MS
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TURN, _REAR = 360.0, 180.0  # degrees
_LONGEST_GAP_MS = 500.0  # of the timer; after a longer one it was restarted, or much was lost
_WIDEST = 30.0  # degrees of a packet, three times those at 10 Hz
# By how much the angle from packet to packet may differ from the speed: a share, and ms.
_SHARE, _SLACK_MS = 0.25, 2.0
_MOST_REFUSED = 20  # packets in a row; then the one before them was wrong
_BEAMS = np.arange(POINTS)


@dataclass(frozen=True, slots=True)
class Revolution:
    """The beams of a revolution, clockwise from the rear, shape (n,) each.

    Attributes
    ----------
    distances
        In mm; 0 without a return, NaN where packets were lost.
    confidences
        Strength of the returns, 0 to 255.
    angle, angle_step
        Of the first beam, counted clockwise from the rear, and from beam to beam [degrees].
    taken_ms, beam_ms
        Time of the first beam by the lidar's timer, which here goes on, and from beam to beam.
    first
        Number of the first beam, counted since the first packet.
    lap
        Number of the revolution, counted since the first packet.
    lost
        Number of beams in lost packets.
    """

    distances: Array
    confidences: Array
    angle: float
    angle_step: float
    taken_ms: float
    beam_ms: float
    first: int
    lap: int
    lost: int

    @property
    def period_ms(self) -> float:
        """Time of a revolution at this speed."""
        return _TURN / self.angle_step * self.beam_ms

    def time_ms(self, beam: int) -> float:
        """Return when a beam near this revolution was measured, counted since the first packet."""
        return self.taken_ms + (beam - self.first) * self.beam_ms


class _Placed(NamedTuple):
    """A packet, with the number and the angle of its first beam, which both go on counting."""

    points: NDArray[np.void]
    beam: int
    angle: float
    step: float
    timer_ms: float

    @property
    def lap(self) -> int:
        """The revolution of its last beam."""
        return math.floor((self.angle + self.step * (POINTS - 1)) / _TURN)


class Revolutions:
    """Takes packets, returns the revolutions that they complete.

    Attributes
    ----------
    refused
        Number of packets whose angles contradict those before.
    """

    def __init__(self) -> None:
        self.refused = 0
        self._refused_in_a_row = 0
        self._packets: list[_Placed] = []  # from the one with the beginning of the revolution on
        self._is_whole = False

    @property
    def newest(self) -> int:
        """The newest beam, counted since the first packet."""
        return self._packets[-1].beam + POINTS - 1

    @property
    def packets_to_go(self) -> int:
        """How many more packets complete the revolution, as far as is known; at least 1."""
        if not self._packets:
            return 1
        newest = self._packets[-1]
        left = _TURN * (self._packets[0].lap + 1) - newest.angle
        return max(math.ceil(left / (POINTS * newest.step) - 1.0), 1)

    def add(self, packets: NDArray[np.void]) -> list[Revolution]:
        """Add packets, shape (n,) of :data:`.PACKET`, and return what they complete.

        The beams before the rear was passed first are left out.

        Raises
        ------
        DeviceError
            If the timer jumps, or the packets go on to contradict those before.
        """
        done = []
        for packet in packets:
            placed = self._place(packet)
            if placed is None:
                self._refuse()
                continue
            self._refused_in_a_row = 0
            self._packets.append(placed)
            lap = self._packets[0].lap
            if placed.lap > lap:
                if self._is_whole:
                    done.append(_revolution(self._packets, lap))
                self._packets, self._is_whole = [placed], True
        return done

    def _refuse(self) -> None:
        self.refused += 1
        self._refused_in_a_row += 1
        if self._refused_in_a_row > _MOST_REFUSED:
            raise DeviceError('the angles of the packets contradict each other')

    def _place(self, packet: np.void) -> _Placed | None:
        """Return where a packet is after the ones before; None if it cannot be there."""
        start, end, speed, timer_ms = (
            float(packet[name]) for name in ('start_angle', 'end_angle', 'speed', 'timer')
        )
        start = start / 100.0 + _REAR
        span = (end / 100.0 + _REAR - start) % _TURN
        if not 0.0 < span <= _WIDEST:
            return None
        points, step = packet['points'], span / (POINTS - 1)
        if not self._packets:
            return _Placed(points, 0, start, step, timer_ms)
        last = self._packets[-1]
        passed_ms = (timer_ms - last.timer_ms) % TIMER_MS
        if passed_ms > _LONGEST_GAP_MS:
            raise DeviceError("the lidar's timer jumped: it was restarted, or much was lost")
        expected = speed * passed_ms / 1e3
        difference = math.remainder(start - last.angle - expected, _TURN)
        if abs(difference) > _SHARE * expected + _SLACK_MS * speed / 1e3:
            return None
        turned = expected + difference
        beam = last.beam + POINTS * max(round(turned / (POINTS * step)), 1)
        return _Placed(points, beam, last.angle + turned, step, last.timer_ms + passed_ms)


def _revolution(packets: list[_Placed], lap: int) -> Revolution:
    """Return the revolution of a lap from its packets and the first one of the next."""
    numbers = [(p.beam, p.angle, p.step, p.timer_ms) for p in packets]
    firsts, angles, steps, timer_ms = np.array(numbers, dtype=np.float64).T
    index = firsts[:, None] + _BEAMS
    angle = angles[:, None] + steps[:, None] * _BEAMS - _TURN * lap
    within = (angle >= 0.0) & (angle < _TURN)
    begin = index[within].min()
    slots = (index[within] - begin).astype(np.int64)
    points = np.stack([p.points for p in packets])[within]
    distances, confidences = np.full(slots[-1] + 1, np.nan), np.zeros(slots[-1] + 1)
    distances[slots], confidences[slots] = points['distance'], points['confidence']
    angle_step, first_angle = np.polyfit(slots, angle[within], 1)
    beam_ms, taken_ms = np.polyfit(firsts + POINTS - 1 - begin, timer_ms, 1)
    return Revolution(
        distances,
        confidences,
        angle=float(first_angle),
        angle_step=float(angle_step),
        taken_ms=float(taken_ms),
        beam_ms=float(beam_ms),
        first=int(begin),
        lap=lap,
        lost=int(np.isnan(distances).sum()),
    )
