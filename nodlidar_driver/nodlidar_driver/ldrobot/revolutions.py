"""Sorts beams into revolutions, each with an even angle and time from beam to beam.

A revolution begins at the rear, so that the beams of a window ahead come one after the other.
"""

from dataclasses import dataclass
import math
from typing import NamedTuple

from nodlidar_common.arrays import Array
from nodlidar_common.errors import DeviceError
from nodlidar_common.ldrobot import POINT_RATE, POINTS, TIMER_MS
import numpy as np
from numpy.typing import NDArray

_TURN, _REAR = 360.0, 180.0  # degrees
_LONGEST_GAP_MS = 500.0  # of the timer; after a longer one it was restarted, or much was lost
_WIDEST = 30.0  # degrees of a packet, three times those at 10 Hz
_PERIOD_MS = POINTS / POINT_RATE * 1e3  # from packet to packet
# By how many packets the angles and the timer may differ: some, and a share of those between.
_OFF, _OFF_SHARE = 0.8, 0.05
# By how much a beginning may be off the end before: a share of a packet, and degrees; after more
# packets than this the speed may have changed.
_SEAM_SHARE, _SEAM, _SEAM_PACKETS = 0.2, 0.05, 3
_MOST_REFUSED = 20  # packets in a row; then the one before them was wrong
_FEWEST = 2 * POINTS  # beams of a revolution that tell its speed
_ROUNDING = 0.05  # of a beam; the speed is not even
_RATE_OFF = 0.02  # of the beams, RMS
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
    uneven
        Greatest difference of a beam from its angle [degrees]: its motor turned unevenly.
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
    uneven: float

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
        self._refused_in_a_row, self._why = 0, ''
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
            If the packets go on to contradict those before: the lidar was restarted, or its motor
            does not turn.
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
                if self._is_whole and (whole := _revolution(self._packets, lap)) is not None:
                    done.append(whole)
                self._packets, self._is_whole = [placed], True
        return done

    def _refuse(self) -> None:
        self.refused += 1
        self._refused_in_a_row += 1
        if self._refused_in_a_row > _MOST_REFUSED:
            raise DeviceError(self._why)

    def _place(self, packet: np.void) -> _Placed | None:
        """Return where a packet is after the ones before; None if it cannot be there."""
        start, end, timer_ms = (float(packet[n]) for n in ('start_angle', 'end_angle', 'timer'))
        start = start / 100.0 + _REAR
        span = (end / 100.0 + _REAR - start) % _TURN
        if not 0.0 < span <= _WIDEST:
            self._why = 'the motor does not turn' if span == 0.0 else 'packets have wrong angles'
            return None
        points, step = packet['points'], span / (POINTS - 1)
        if not self._packets:
            return _Placed(points, 0, start, step, timer_ms)
        last = self._packets[-1]
        passed_ms = (timer_ms - last.timer_ms) % TIMER_MS
        if passed_ms > _LONGEST_GAP_MS:
            self._why = "the lidar's timer jumped: it was restarted, or much was lost"
            return None
        by_timer, width = passed_ms / _PERIOD_MS, POINTS * step
        off = math.remainder(start - last.angle - by_timer * width, _TURN) / width
        by_angle = by_timer + off
        packets = round(by_angle)
        seam = abs(by_angle - packets) * width
        if (
            packets < 1
            or abs(off) > _OFF + _OFF_SHARE * by_timer
            or (packets <= _SEAM_PACKETS and seam > _SEAM_SHARE * width + _SEAM)
        ):
            self._why = 'angles and timer of the packets contradict each other'
            return None
        beam, angle = last.beam + POINTS * packets, last.angle + by_angle * width
        return _Placed(points, beam, angle, step, last.timer_ms + passed_ms)


def _revolution(packets: list[_Placed], lap: int) -> Revolution | None:
    """Return the revolution of a lap from its packets and the next one; None if little came."""
    numbers = [(p.beam, p.angle, p.step, p.timer_ms) for p in packets]
    firsts, angles, steps, timer_ms = np.array(numbers, dtype=np.float64).T
    beam = (firsts[:, None] + _BEAMS).astype(np.int64)
    angle = angles[:, None] + steps[:, None] * _BEAMS - _TURN * lap
    within = (angle >= 0.0) & (angle < _TURN)
    beam, angle = beam[within], angle[within]
    if len(beam) < _FEWEST:
        return None
    angle_step, at_first = np.polyfit(beam - beam[0], angle, 1)
    # Beams lost at the ends: the first and the last one are within a beam of the rear.
    before = _missing(angle[0] / angle_step)
    begin = int(beam[0]) - before
    count = int(beam[-1]) - begin + 1 + _missing((_TURN - angle[-1]) / angle_step)
    points = np.stack([p.points for p in packets])[within]
    distances, confidences = np.full(count, np.nan), np.zeros(count)
    distances[beam - begin], confidences[beam - begin] = points['distance'], points['confidence']
    taken_ms, beam_ms = _times(firsts + POINTS - 1 - begin, timer_ms)
    return Revolution(
        distances,
        confidences,
        angle=float(at_first - before * angle_step),
        angle_step=float(angle_step),
        taken_ms=taken_ms,
        beam_ms=beam_ms,
        first=begin,
        lap=lap,
        lost=int(np.isnan(distances).sum()),
        uneven=float(np.abs(at_first + (beam - beam[0]) * angle_step - angle).max()),
    )


def _times(beam: Array, timer_ms: Array) -> tuple[float, float]:
    """Return the time of beam 0, and from beam to beam [ms], of beams at whole ms, shape (n,).

    Few packets hardly tell the rate of the beams, but it is known to _RATE_OFF.
    """
    usual_ms = 1e3 / POINT_RATE
    rounding, off = 12.0**-0.5, _RATE_OFF * usual_ms  # RMS
    away, middle = beam - beam.mean(), timer_ms.mean()
    information = float(away @ away) / rounding**2 + 1.0 / off**2
    beam_ms = (float(away @ timer_ms) / rounding**2 + usual_ms / off**2) / information
    return float(middle - beam_ms * beam.mean()), beam_ms


def _missing(beams: float) -> int:
    """Return how many beams are missing in an angle that has one if none is."""
    return max(math.ceil(beams - 1.0 - _ROUNDING), 0)
