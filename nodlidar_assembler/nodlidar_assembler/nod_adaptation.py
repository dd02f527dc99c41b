"""The nod that goes with what is seen: limits from the median range, and an N_s the servo holds.

A band of heights that is kept over distance has N_s rows in a traverse, wherever it is seen from:
as long as N_s stays, so does the distance between rows on what is seen. So the planned N_s is
left only for a span that the servo cannot traverse in its time.
"""

import math

from nodlidar_assembler.nod_clock import NodShape
from nodlidar_assembler.pitch_limits import PitchLimits
from nodlidar_common.errors import ParameterError

# An N_s stays until the span is less by this share than what it is needed for, lest it hunt.
MARGIN = 0.1


def samples_needed(span: float, planned: int, fastest: float, beam_period: float, n_l: int) -> int:
    """Return the least N_s from the planned one on that is coprime and no faster than allowed.

    Parameters
    ----------
    span
        Pitch from limit to limit [rad].
    planned
        N_s that is wanted.
    fastest
        Speed that the servo holds [rad/s].
    beam_period
        T_s [s].
    n_l
        Steps in a revolution of the lidar, dark ones counted.
    """
    n_s = max(planned, math.ceil(span / (fastest * beam_period)))
    while math.gcd(n_s, n_l) > 1:
        n_s += 1
    return n_s


class NodAdaptation:
    """Gives the shape of the nod at any instant.

    Parameters
    ----------
    limits
        Told of scans and of motion by whoever has them.
    planned
        N_s that is wanted.
    fastest
        Speed that the servo holds [rad/s].
    steps_per_revolution
        N_L, dark steps counted.

    Raises
    ------
    ParameterError
        If N_s, N_L or the speed is not positive.
    """

    def __init__(
        self, limits: PitchLimits, planned: int, fastest: float, steps_per_revolution: int
    ) -> None:
        if planned < 1:
            raise ParameterError('samples_per_sweep', 'at least 1', planned)
        if steps_per_revolution < 1:
            raise ParameterError('steps_per_revolution', 'at least 1', steps_per_revolution)
        if not 0.0 < fastest < math.inf:
            raise ParameterError('fastest', 'above 0 rad/s and finite', fastest)
        self.limits = limits
        self._planned, self._fastest, self._n_l = planned, fastest, steps_per_revolution
        self._samples = planned

    def shape(self, time_ns: int, beam_period: float) -> NodShape:
        """Return limits and N_s at an instant [ns], with the lidar's beam period [s].

        Raises
        ------
        ParameterError
            If the instant lies before that of the last call.
        """
        low, high = self.limits.limits(time_ns)
        needed, enough = (
            samples_needed(span, self._planned, self._fastest, beam_period, self._n_l)
            for span in (high - low, (high - low) * (1.0 + MARGIN))
        )
        if not needed <= self._samples <= enough or math.gcd(self._samples, self._n_l) > 1:
            self._samples = needed
        return NodShape(low, high, self._samples)
