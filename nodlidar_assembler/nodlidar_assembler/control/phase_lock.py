"""The nod phase-locked to the lidar's revolutions: sample n always has the phase n + 1/2.

Samples are counted from the first scan: sample n is step n mod N_L, counted from a scan's first
beam, of revolution n // N_L. With the half-sample phase, gcd(N_s, N_L) = 1 and N_L even, the
samples of N_s revolutions hit every cell of the finest grid exactly once (docs/model.md, "The
pattern").
"""

import math

from nodlidar_assembler.clouds.geometry import revolution_time, ScanGeometry
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.inputs.revolutions import Revolutions
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S


class PhaseLock:
    """Keeps the nod command phase-locked to the lidar, by all scans so far.

    Parameters
    ----------
    shape
        Shape of the nod.
    steps_per_revolution
        N_L, dark steps included.

    Attributes
    ----------
    shape
        The present shape.
    steps
        N_L; after setting another one, call `change`.
    revolutions
        The lidar's revolutions, by all scans so far.
    nod
        The present command; None before the first scan.
    """

    def __init__(self, shape: NodShape, steps_per_revolution: int) -> None:
        self.shape = shape
        self.revolutions = Revolutions()
        self.nod: Nod | None = None
        self.steps = steps_per_revolution
        self._first_revolution = 0  # the one that sample 0 is in

    def add_scan(self, geometry: ScanGeometry, stamp_ns: int) -> None:
        """Add a scan; the command follows its clock.

        After a restart of the lidar the nod continues from its present pitch, at the nearest
        sample that the new phase of the revolutions allows.

        Parameters
        ----------
        geometry
            Geometry of the scan; its rate of rotation is used until stamps give a better one.
        stamp_ns
            Instant of the scan's first beam [ns].

        Raises
        ------
        ParameterError
            If the scan does not state its beam period.
        """
        nominal = revolution_time(geometry)
        if nominal <= 0.0:
            raise ParameterError('time_increment', 'above 0 s', geometry.time_increment)
        restarts = self.revolutions.restarts
        self.revolutions.add(stamp_ns, nominal)
        if self.nod is not None and self.revolutions.restarts > restarts:
            self._continue(self.nod, self.revolutions.begin_ns)
        self.nod = self._present()

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]."""
        self.revolutions.shift(step_ns)
        if self.nod is not None:
            self.nod = self.nod.shifted(step_ns)

    def change(self, shape: NodShape, now_ns: int, present: Nod | None = None) -> None:
        """Change limits or N_s; the nod continues from its present pitch and direction.

        The present nod is the one commanded last, unless `present` is given. A nod outside its
        new limits gets the time to return: it reverses at the limit when the servo, at the nod's
        speed, reaches it, after a sweep at most.
        """
        self.shape = shape
        if self.nod is not None:
            self._continue(present or self.nod, now_ns)
            self.nod = self._present()

    def begin(self, shape: NodShape, place: int, begin_ns: int) -> None:
        """Begin a nod of a shape at one of its limits, as nearly as the revolutions allow.

        Parameters
        ----------
        shape
            Limits and N_s.
        place
            0 to begin at the lower limit, N_s at the upper one.
        begin_ns
            When it begins [ns]; there must have been a scan.
        """
        self.shape = shape
        self._count_from(place, begin_ns)
        self.nod = self._present()

    def _present(self) -> Nod:
        """Return the nod; its reference is the last start of an upward sweep before this scan."""
        lidar, n_s = self.revolutions, self.shape.samples_per_sweep
        beam_period = lidar.period / self.steps
        sample = (lidar.count - self._first_revolution) * self.steps
        since = (sample % (2 * n_s) + 0.5) * beam_period
        return Nod(
            pitch_min=self.shape.pitch_min,
            pitch_max=self.shape.pitch_max,
            sweep_duration=n_s * beam_period,
            samples_per_sweep=n_s,
            reference_time_ns=lidar.begin_ns - round(since * NS_PER_S),
        )

    def _continue(self, nod: Nod, time_ns: int) -> None:
        """Count samples so that the nod keeps its pitch at an instant, as nearly as possible."""
        self._count_from(_place(nod, time_ns, self.shape), time_ns)

    def _count_from(self, place: float, time_ns: int) -> None:
        """Count samples so that the nod is at a place [samples] at an instant."""
        lidar, n_s = self.revolutions, self.shape.samples_per_sweep
        since = (time_ns - lidar.begin_ns) / NS_PER_S / lidar.period * self.steps
        begun = place - since
        elapsed = revolutions_to(round(begun - 0.5), n_s, self.steps)
        self._first_revolution = lidar.count - elapsed


def revolutions_to(place: int, samples_per_sweep: int, steps_per_revolution: int) -> int:
    """Return the number of revolutions after which one begins at, or next to, a place of the nod.

    Revolution r begins at place r N_L mod 2 N_s, a multiple of gcd(N_L, 2 N_s).

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


def _place(nod: Nod, time_ns: int, shape: NodShape) -> float:
    """Return how many samples past a shape's lower limit a nod is, by pitch and direction.

    A nod outside a limit moves toward it, from at most one sweep away.
    """
    height = (float(nod.pitch(time_ns)) - shape.pitch_min) / (shape.pitch_max - shape.pitch_min)
    height = min(max(height, -1.0), 2.0)
    outside = not 0.0 <= height <= 1.0
    rises = height > 1.0 if outside else float(nod.velocity(time_ns)) > 0.0
    way = (1.0 - abs(1.0 - abs(height))) * shape.samples_per_sweep
    return way if rises else 2 * shape.samples_per_sweep - way
