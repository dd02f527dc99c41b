"""The nod: the commanded pitch at any instant."""

from dataclasses import dataclass, replace
import math

from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.stamps import NS_PER_S
import numpy as np


@dataclass(frozen=True, slots=True)
class Nod:
    """A triangle wave between two pitch limits, for all times.

    Attributes
    ----------
    pitch_min, pitch_max
        Limits of the nod [rad], positive up.
    sweep_duration
        Time of one sweep, from limit to limit [s]: samples_per_sweep beam periods.
    samples_per_sweep
        N_s, the steps of the lidar in one sweep, dark ones included.
    reference_time_ns
        An instant [ns] at which the nod is at pitch_min, going up.

    Raises
    ------
    ParameterError
        If the limits are not finite and ascending, or the duration or N_s is not positive.
    """

    pitch_min: float
    pitch_max: float
    sweep_duration: float
    samples_per_sweep: int
    reference_time_ns: int

    def __post_init__(self) -> None:
        for key in ('pitch_min', 'pitch_max', 'sweep_duration'):
            if not math.isfinite(getattr(self, key)):
                raise ParameterError(key, 'finite', getattr(self, key))
        if self.pitch_max <= self.pitch_min:
            raise ParameterError(
                'pitch_max', f'above pitch_min = {self.pitch_min} rad', self.pitch_max
            )
        if self.sweep_duration <= 0.0:
            raise ParameterError('sweep_duration', 'above 0 s', self.sweep_duration)
        if self.samples_per_sweep < 1:
            raise ParameterError('samples_per_sweep', 'at least 1', self.samples_per_sweep)

    def shifted(self, step_ns: int) -> 'Nod':
        """Return the same nod in the time of a clock that was set by a step [ns]."""
        return replace(self, reference_time_ns=self.reference_time_ns + step_ns)

    @property
    def span(self) -> float:
        """Pitch from limit to limit [rad]."""
        return self.pitch_max - self.pitch_min

    @property
    def speed(self) -> float:
        """Constant speed between the reversals [rad/s], always positive."""
        return self.span / self.sweep_duration

    def sweeps(self, time_ns: Times | int) -> Array:
        """Return the sweeps from the reference time to times [ns], of any shape.

        Even whole numbers are at pitch_min. Times are subtracted as integers, so that absolute
        stamps lose no precision.
        """
        elapsed = np.asarray(time_ns, dtype=np.int64) - np.int64(self.reference_time_ns)
        return np.asarray(elapsed / (self.sweep_duration * NS_PER_S), dtype=np.float64)

    def sweep_at(self, time_ns: int) -> float:
        """Return `sweeps` at one time [ns], which takes a tenth of the time of an array's."""
        return (time_ns - self.reference_time_ns) / (self.sweep_duration * NS_PER_S)

    def pitch(self, time_ns: Times | int) -> Array:
        """Return the commanded pitch [rad] at times [ns], of any shape."""
        leg = np.mod(self.sweeps(time_ns), 2.0)
        height: Array = 1.0 - np.abs(leg - 1.0)
        return self.pitch_min + self.span * height

    def velocity(self, time_ns: Times | int) -> Array:
        """Return the commanded velocity [rad/s] at times [ns]; at a reversal the new one."""
        return np.where(np.mod(self.sweeps(time_ns), 2.0) < 1.0, self.speed, -self.speed)

    def reversal_time_ns(self, sweep: int) -> int:
        """Return the instant [ns] at which a sweep begins (even ones at pitch_min)."""
        return self.reference_time_ns + round(sweep * self.sweep_duration * NS_PER_S)
