"""Positions of the nod joint, and pitches of the scan plane."""

from dataclasses import dataclass, replace

from nodlidar_common.nod import Nod

INSIDE = 1e-6  # rad, against rounding


@dataclass(frozen=True, slots=True)
class JointAxis:
    """How the scan plane turns with the joint.

    Attributes
    ----------
    sign
        1 if the beams rise as the position rises, -1 if they sink.
    zero
        Position at pitch 0 [rad].
    """

    sign: float
    zero: float

    def pitch(self, position: float) -> float:
        """Return the pitch at a position [rad]."""
        return self.sign * (position - self.zero)

    def position(self, pitch: float) -> float:
        """Return the position at a pitch [rad]."""
        return self.sign * pitch + self.zero

    def pitches(self, lower: float, upper: float) -> tuple[float, float]:
        """Return the lowest and the highest pitch between two positions [rad].

        Where they are converted, they are INSIDE, and stay so when they are converted back.
        """
        if self == UNCHANGED:
            return lower, upper
        one, other = self.pitch(lower), self.pitch(upper)
        return min(one, other) + INSIDE, max(one, other) - INSIDE

    def positions(self, nod: Nod) -> Nod:
        """Return a nod of the scan plane as one of the joint's positions."""
        ends = self.position(nod.pitch_min), self.position(nod.pitch_max)
        # Where the pitch rises, the position of a joint that is positive down falls.
        first = 0 if self.sign > 0.0 else 1
        return replace(
            nod,
            pitch_min=min(ends),
            pitch_max=max(ends),
            reference_time_ns=nod.reversal_time_ns(first),
        )


UNCHANGED = JointAxis(1.0, 0.0)
