"""The nod tied to the lidar's revolutions: sample n has the phase n + 1/2, for as long as it runs.

The samples are counted from the first scan: sample n is beam n mod N_L, counted from the first one
of a scan, of revolution n // N_L. With the half-sample phase, gcd(N_s, N_L) = 1 and N_L even the
samples of N_s revolutions fall on all cells of the finest grid exactly once (docs/model.md, "The
pattern").
"""

from dataclasses import dataclass
import math

from nodlidar_assembler.clouds.geometry import revolution_time, ScanGeometry
from nodlidar_assembler.control.revolutions import Revolutions
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NodTrajectory, NS_PER_S


@dataclass(frozen=True, slots=True)
class NodShape:
    """Limits [rad] and N_s of a nod.

    Raises
    ------
    ParameterError
        If they make no nod.
    """

    pitch_min: float
    pitch_max: float
    samples_per_sweep: int

    def __post_init__(self) -> None:
        NodTrajectory(self.pitch_min, self.pitch_max, 1.0, self.samples_per_sweep, 0)


class NodClock:
    """Gives the nod command that is tied to the lidar by all scans so far.

    Parameters
    ----------
    shape
        Of the nod.
    steps_per_revolution
        N_L, dark steps counted.
    """

    def __init__(self, shape: NodShape, steps_per_revolution: int) -> None:
        self.shape = shape
        self.revolutions = Revolutions()
        self.nod: NodTrajectory | None = None
        """The present command; None before the first scan."""
        self._steps = steps_per_revolution
        self._first_revolution = 0  # the one that sample 0 is in

    def add_scan(self, geometry: ScanGeometry, stamp_ns: int) -> None:
        """Add a scan; the command follows its clock.

        After a restart of the lidar the nod goes on where it is, at the nearest sample that the
        new phase of the revolutions allows.

        Parameters
        ----------
        geometry
            Of the scan; its rate of rotation is believed until stamps tell a better one.
        stamp_ns
            Instant of the scan's first beam [ns].

        Raises
        ------
        ParameterError
            If the scan does not tell its beam period.
        """
        nominal = revolution_time(geometry)
        if nominal <= 0.0:
            raise ParameterError('time_increment', 'above 0 s', geometry.time_increment)
        restarts = self.revolutions.restarts
        self.revolutions.add(stamp_ns, nominal)
        if self.nod is not None and self.revolutions.restarts > restarts:
            self._continue(self.nod, self.revolutions.begin_ns)
        self.nod = self._trajectory()

    def shift(self, step_ns: int) -> None:
        """Go on as before although the clock was set by a step [ns]."""
        self.revolutions.shift(step_ns)
        if self.nod is not None:
            self.nod = self.nod.shifted(step_ns)

    def change(self, shape: NodShape, now_ns: int, present: NodTrajectory | None = None) -> None:
        """Change limits or N_s; the nod goes on from the pitch and the direction that it has now.

        The present nod is the one that was commanded last, unless another is given.
        A nod that is outside of its new limits is given the time to come back to them: it turns at
        that limit when the servo, at the nod's speed, is there, after a sweep at most.
        """
        self.shape = shape
        if self.nod is not None:
            self._continue(present or self.nod, now_ns)
            self.nod = self._trajectory()

    def _trajectory(self) -> NodTrajectory:
        """Return the nod, with the last start of a way up before the newest scan as reference."""
        lidar, n_s = self.revolutions, self.shape.samples_per_sweep
        beam_period = lidar.period / self._steps
        sample = (lidar.count - self._first_revolution) * self._steps
        since = (sample % (2 * n_s) + 0.5) * beam_period
        return NodTrajectory(
            pitch_min=self.shape.pitch_min,
            pitch_max=self.shape.pitch_max,
            sweep_duration=n_s * beam_period,
            samples_per_sweep=n_s,
            reference_time_ns=lidar.begin_ns - round(since * NS_PER_S),
        )

    def _continue(self, nod: NodTrajectory, time_ns: int) -> None:
        """Count samples such that at a time the nod is where it was, as near as scans let."""
        lidar, n_s = self.revolutions, self.shape.samples_per_sweep
        since = (time_ns - lidar.begin_ns) / NS_PER_S / lidar.period * self._steps
        begun = _place(nod, time_ns, self.shape) - since
        done = revolutions_to(round(begun - 0.5), n_s, self._steps)
        self._first_revolution = lidar.count - done


def revolutions_to(place: int, samples_per_sweep: int, steps_per_revolution: int) -> int:
    """Return after how many revolutions the nod begins one at, or next to, a place.

    Revolution r begins at place r N_L mod 2 N_s; that takes on all multiples of gcd(N_L, 2 N_s).

    Parameters
    ----------
    place
        Samples since the nod was at its lower limit, going up.
    samples_per_sweep, steps_per_revolution
        N_s and N_L.
    """
    period = 2 * samples_per_sweep
    divisor = math.gcd(steps_per_revolution, period)
    classes = period // divisor
    inverse = pow(steps_per_revolution // divisor, -1, classes) if classes > 1 else 0
    return round(place / divisor) * inverse % classes


def _place(nod: NodTrajectory, time_ns: int, shape: NodShape) -> float:
    """Return how many samples of a shape past its lower limit a nod is, by pitch and direction.

    As far as a nod is outside of a limit, a sweep at most, so far it has to go to that limit.
    """
    height = (float(nod.pitch(time_ns)) - shape.pitch_min) / (shape.pitch_max - shape.pitch_min)
    height = min(max(height, -1.0), 2.0)
    outside = not 0.0 <= height <= 1.0
    rises = height > 1.0 if outside else float(nod.velocity(time_ns)) > 0.0
    way = (1.0 - abs(1.0 - abs(height))) * shape.samples_per_sweep
    return way if rises else 2 * shape.samples_per_sweep - way
