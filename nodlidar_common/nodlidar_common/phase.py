"""Lateness of the servo against the nod, and the lead that compensates it.

A servo reverses late: the command waits for a reply in the adapter, then the motor takes its time.
A leg that begins late and ends on time is late in the middle. Led by this lateness, it begins as
late as it ends early, and its phase is as commanded.
"""

from collections import deque
import math
from typing import Protocol

from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
import numpy as np

MIDDLE = 0.25
"""The phase is measured in this share of the leg on either side of its middle, where the servo
neither accelerates nor brakes."""

LOCKED = 0.15
"""A servo that is later or earlier than this [s], or than MIDDLE of a short sweep, is on its way
to the nod and has no phase. So the nod is led by up to this time.

The position loop of a servo lags its goal: by 48 ms in an XL430, by twice as much if its gain has
half the scale of the e-manual, by a tenth of a second in a hobby servo.
"""

FASTEST_LEAD = 0.05
"""The lead changes by at most this share of the time: a joint follows without a jolt."""

_GAIN = 0.02  # weight of a sample: errors decay in about 50 samples, 4 legs at 62 Hz
_SETTLED = 50  # samples in phase, after which the servo causes the lateness
_OTHER = 0.01  # a nod that is elsewhere by more [s] is another one: the servo is on its way to it
_SMOOTHING = 0.05  # weight of a sample in the reported error
_DRIFT_SAMPLES, _FEWEST_DRIFT_SAMPLES = 1000, 100  # half a minute; 3 s
_DRIFT_EVERY = 50  # samples: the fit takes longer than the rest of a cycle


class Pitched(Protocol):
    """A measured pitch [rad] at a time [ns]."""

    @property
    def stamp_ns(self) -> int: ...  # noqa: D102
    @property
    def pitch(self) -> float: ...  # noqa: D102


def longest_lateness(nod: Nod) -> float:
    """Return how late or early a servo on the nod may be [s]; see LOCKED."""
    return min(LOCKED, MIDDLE * nod.sweep_duration)


def lateness(nod: Nod, sample: Pitched, cruise: float) -> float | None:
    """Return how late the servo is [s]; None outside of the middle of the leg.

    Parameters
    ----------
    nod
        The commanded nod.
    sample
        The measurement.
    cruise
        Speed in mid-leg [rad/s] of a servo that is in phase: above the nod's, since it starts
        from rest and ends at rest.
    """
    sweeps = nod.sweep_at(sample.stamp_ns)
    leg = math.floor(sweeps)
    since_middle = (sweeps - leg - 0.5) * nod.sweep_duration
    if abs(since_middle) > MIDDLE * nod.sweep_duration:
        return None
    direction = 1.0 if leg % 2 == 0 else -1.0
    way = direction * (sample.pitch - (nod.pitch_min + nod.pitch_max) / 2.0)
    return since_middle - way / cruise


class PhaseDrift:
    """Measures N_s, from how the lateness changes over time.

    Attributes
    ----------
    measured_ratio
        Measured N_s over the commanded one; NaN before 100 samples.
    """

    def __init__(self) -> None:
        self.measured_ratio = math.nan
        self._late: deque[tuple[int, float]] = deque(maxlen=_DRIFT_SAMPLES)
        self._added = 0

    def add(self, time_ns: int, late: float) -> None:
        """Add how late [s] the servo was at a time [ns]."""
        self._late.append((time_ns, late))
        self._added += 1
        if self._added % _DRIFT_EVERY == 0 and len(self._late) >= _FEWEST_DRIFT_SAMPLES:
            self.measured_ratio = self._fitted_ratio()

    def clear(self) -> None:
        """Restart: the servo is not on the nod."""
        self._late.clear()
        self.measured_ratio = math.nan

    def _fitted_ratio(self) -> float:
        samples = list(self._late)
        times = np.array([(time_ns - samples[0][0]) / NS_PER_S for time_ns, _ in samples])
        return 1.0 + float(np.polyfit(times, [late for _, late in samples], 1)[0])


class PhaseLead:
    """Leads the nod by the average lateness of the servo.

    Attributes
    ----------
    error
        Mean lateness over about two legs [s]; NaN while the servo is not on the nod.
    lead_ns
        Time by which the nod is led [ns].
    drift
        Change of the lateness while the servo is on the nod.
    """

    def __init__(self) -> None:
        self.error = math.nan
        self.lead_ns = 0
        self.drift = PhaseDrift()
        self._lead = 0.0
        self._in_phase = 0
        self._measured_ns = 0
        self._nod: Nod | None = None

    def add(self, nod: Nod, sample: Pitched, cruise: float) -> None:
        """Add a measurement; parameters as in :func:`lateness`."""
        if self._nod is not None and _is_elsewhere(nod, self._nod, sample.stamp_ns):
            self._in_phase = 0
        self._nod = nod
        late = lateness(nod, sample, cruise)
        if late is None:
            return
        elapsed = (sample.stamp_ns - self._measured_ns) / NS_PER_S
        self._measured_ns = sample.stamp_ns
        if abs(late) > longest_lateness(nod):
            self.error, self._in_phase = math.nan, 0
            self.drift.clear()
            return
        self._in_phase += 1
        self.drift.add(sample.stamp_ns, late)
        known = math.isfinite(self.error)
        self.error = self.error + _SMOOTHING * (late - self.error) if known else late
        if self._in_phase > _SETTLED:
            most = FASTEST_LEAD * max(elapsed, 0.0)
            lead = self._lead + min(max(_GAIN * late, -most), most)
            self._lead = min(max(lead, -LOCKED), LOCKED)
            self.lead_ns = round(self._lead * NS_PER_S)


def _is_elsewhere(nod: Nod, former: Nod, time_ns: int) -> bool:
    """Return whether a nod does not continue a former one: a tuned nod does, and a next sweep."""
    if nod is former:
        return False
    apart = float(nod.pitch(time_ns) - former.pitch(time_ns))
    return abs(apart) > _OTHER * nod.speed
