"""The way from the present nod to one that takes over."""

from nodlidar_assembler.control.nod_config import NodConfig
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.pattern.nod_speeds import shortest_by_mean_speed

# Speed of the way [rad/s], and time to settle [s]: what an RX-24F needs from any nod.
SPEED, SETTLING = 3.0, 0.3
# Sweeps of the way are longer than the shortest by this factor.
EASE = 1.5


class Takeover:
    """A fast leg to the nearer limit of another nod, which may be slow, and that nod from then on.

    A servo that is given a slow nod approaches it slowly. So it is given a fast one between the
    same limits first, which is at the limit when the slow one begins there.

    Parameters
    ----------
    present
        The nod until now.
    shape
        The nod that takes over.
    now_ns
        The present time [ns].
    config
        What the servo can do.

    Attributes
    ----------
    approach
        The fast nod.
    begin_ns, place
        When the other nod begins [ns]; 0 if it does at the lower limit, else its N_s.
    approaching
        Whether the servo is still to be given the fast nod.
    """

    def __init__(self, present: Nod, shape: NodShape, now_ns: int, config: NodConfig) -> None:
        pitch = float(present.pitch(now_ns))
        low, high = shape.pitch_min, shape.pitch_max
        below, above = abs(pitch - low), abs(pitch - high)
        self.place = 0 if below <= above else shape.samples_per_sweep
        fastest = min(SPEED, config.max_nod_speed)
        self.begin_ns = now_ns + round((min(below, above) / fastest + SETTLING) * NS_PER_S)
        sweep = EASE * shortest_by_mean_speed(high - low, fastest, config.max_nod_acceleration)
        upper = 0 if self.place == 0 else round(sweep * NS_PER_S)
        samples = max(1, round(sweep / config.task.beam_period))
        self.approach = Nod(low, high, sweep, samples, self.begin_ns - upper)
        self.approaching = True

    def command(self, nod: Nod) -> tuple[Nod, int]:
        """Return what to command, and from when on [ns], for the nod that takes over."""
        return (self.approach, 0) if self.approaching else (nod, self.begin_ns)

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]."""
        self.begin_ns += step_ns
        self.approach = self.approach.shifted(step_ns)
