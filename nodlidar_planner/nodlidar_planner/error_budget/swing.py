"""The nod as it is driven: straight legs, joined by parabolas."""

from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.rounding import rounded_up
import numpy as np


@dataclass(frozen=True, slots=True)
class Swing:
    """A nod with a speed [rad/s], a sweep duration [s] and an acceleration of reversals [rad/s^2].

    Raises
    ------
    ParameterError
        If the speed is not positive, or a sweep too short for its reversals.
    """

    speed: float
    sweep_duration: float
    acceleration: float

    def __post_init__(self) -> None:
        if not self.speed > 0.0:
            raise ParameterError('speed', 'above 0 rad/s', self.speed)
        least = 2.0 * self.speed / self.sweep_duration
        if self.acceleration < least:
            limit = (
                f'at least {rounded_up(least)} rad/s^2, for sweeps of {self.sweep_duration:.4g} s'
            )
            raise ParameterError('reversal_acceleration', limit, self.acceleration)

    @property
    def reversal_time(self) -> float:
        """Duration of a reversal [s]."""
        return 2.0 * self.speed / self.acceleration

    @property
    def mean_square_speed(self) -> float:
        """Mean of the squared speed [rad^2/s^2].

        Within a reversal the speed falls and rises linearly, so its mean square there is a third.
        """
        reversing = self.reversal_time / self.sweep_duration
        return self.speed**2 * (1.0 - 2.0 / 3.0 * reversing)

    def pitch(self, times: Array) -> Array:
        """Return the pitch [rad] from mid-span, shape (n,), at times [s] from a lower limit."""
        since_limit = np.mod(times, self.sweep_duration)
        to_reversal = np.minimum(since_limit, self.sweep_duration - since_limit)
        rounded = np.maximum(self.reversal_time / 2.0 - to_reversal, 0.0)
        downward = np.mod(np.floor(times / self.sweep_duration), 2.0)
        side = np.where(since_limit < self.sweep_duration / 2.0, 1.0, -1.0)
        direction = 1.0 - 2.0 * downward
        line = direction * self.speed * (since_limit - self.sweep_duration / 2.0)
        return np.asarray(line + direction * side * self.acceleration / 2.0 * rounded**2)
