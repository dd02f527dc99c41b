"""The scan pattern: where the lidar points at sample n, exact in integers (docs/model.md)."""

from dataclasses import dataclass
import math
import operator

from nodlidar_common.arrays import Array, Integers, Mask
from nodlidar_common.errors import ParameterError
import numpy as np

# Half a sample of phase: with it, N_s coprime with an even N_L hits every finest cell just once.
HALF_SAMPLE = 0.5
# Steps and samples per sweep; one whole period is then counted in 64 bits.
MOST = 2**30
# A planned nod has at most these, for memory; the closed forms of Pattern have no such bound.
MAX_SAMPLES_PER_SWEEP = 1_000_000


@dataclass(frozen=True, slots=True)
class Pattern:
    """Samples n = 0, 1, 2 ... of a lidar that revolves while it nods.

    Attributes
    ----------
    steps_per_revolution
        N_L, dark steps included.
    samples_per_sweep
        N_s, samples in one sweep from limit to limit.
    phase
        Samples that the nod is past its lower limit, going up, at sample 0; [0, 2 N_s).

    Raises
    ------
    ParameterError
        If N_L or N_s is not a whole number from 1 to 2**30, or the phase is out of its range.
    """

    steps_per_revolution: int
    samples_per_sweep: int
    phase: float = HALF_SAMPLE

    def __post_init__(self) -> None:
        for key in ('steps_per_revolution', 'samples_per_sweep'):
            object.__setattr__(self, key, _count(key, getattr(self, key)))
        if not 0.0 <= self.phase < self.cycle:
            raise ParameterError('phase', f'at least 0 and below {self.cycle}', self.phase)

    @property
    def cycle(self) -> int:
        """Samples from lower limit to lower limit: 2 N_s."""
        return 2 * self.samples_per_sweep

    @property
    def period(self) -> int:
        """Samples after which azimuth step and nod repeat together: lcm(N_L, 2 N_s)."""
        return math.lcm(self.steps_per_revolution, self.cycle)

    @property
    def stride(self) -> int:
        """gcd(N_L, 2 N_s): sample n has n mod N_L and n mod 2 N_s equal modulo this."""
        return math.gcd(self.steps_per_revolution, self.cycle)

    @property
    def repeats(self) -> int:
        """How many times sooner it repeats than with an N_s that is coprime with N_L."""
        return self.stride // math.gcd(self.steps_per_revolution, 2)

    @property
    def distinct_directions(self) -> int:
        """Number of distinct directions, in closed form (docs/model.md, "The pattern")."""
        twice = 2.0 * self.phase
        even_stride = self.stride % 2 == 0
        if not twice.is_integer() or (even_stride and twice % 2.0 == 1.0):
            return self.period
        # A place in the nod and its mirror image on the other leg see the same steps if they are
        # equal modulo the stride: one class or two. All of these coincide but the reversals.
        meeting = self.cycle // self.stride * (2 if even_stride else 1)
        reversals = 2 if twice % 2.0 == 0.0 else 0
        pairs = (meeting - reversals) // 2
        return self.period - self.steps_per_revolution // self.stride * pairs

    def step(self, n: Integers | int) -> Integers:
        """Return the azimuth step of each sample n, of any shape, 0 .. N_L - 1."""
        return np.asarray(n, dtype=np.int64) % self.steps_per_revolution

    def height(self, n: Integers | int) -> Array:
        """Return the height of each sample above the lower limit, 0 .. N_s; unit span / N_s.

        This is tri(n + phase) of docs/model.md, rounded once.
        """
        place, past = self._place(n), self.phase - math.floor(self.phase)
        height = np.where(place < self.samples_per_sweep, place + past, self.cycle - place - past)
        return height.astype(np.float64)

    def pitch(self, n: Integers | int, pitch_min: float, pitch_max: float) -> Array:
        """Return the pitch [rad] of each sample n, of any shape, of a nod between limits [rad]."""
        return pitch_min + (pitch_max - pitch_min) / self.samples_per_sweep * self.height(n)

    def going_up(self, n: Integers | int) -> Mask:
        """Return whether each sample n, of any shape, is on an upward leg or begins it."""
        return self._place(n) < self.samples_per_sweep

    def whole_revolutions(self, distance: Integers | int) -> Integers:
        """Return the fewest samples, in whole revolutions, that advance the nod by a distance.

        The distance [samples] is a multiple of the stride and counts modulo the nod's cycle.
        """
        revolutions = self.cycle // self.stride
        inverse: int = pow(self.steps_per_revolution // self.stride, -1, revolutions)
        strides = np.asarray(distance, dtype=np.int64) // self.stride
        return strides * inverse % revolutions * self.steps_per_revolution

    def _place(self, n: Integers | int) -> Integers:
        """Return the whole samples past the lower limit, 0 .. 2 N_s - 1."""
        in_cycle = np.asarray(n, dtype=np.int64) % self.cycle
        return (in_cycle + math.floor(self.phase)) % self.cycle


def _count(key: str, value: object) -> int:
    """Return a whole number from 1 to MOST as an int; it may be of NumPy."""
    limit = f'a whole number from 1 to {MOST}'
    try:
        count = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ParameterError(key, limit, value) from None
    if not 1 <= count <= MOST:
        raise ParameterError(key, limit, value)
    return count
