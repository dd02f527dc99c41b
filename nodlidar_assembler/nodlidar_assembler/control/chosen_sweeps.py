"""The nod, sweep by sweep: each of a duration that hits unseen cells, or by a schedule.

A sweep is chosen shortly before it begins, during the one before it: late enough to know where
nearly all beams went, early enough for the command to reach the servo.
"""

from collections import deque
from dataclasses import replace
import math

from nodlidar_assembler.clouds.geometry import ScanGeometry
from nodlidar_assembler.inputs.revolutions import Revolutions
from nodlidar_common.arrays import Array, Times
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.stamps import NS_PER_S
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.sweeps.feedback import Feedback
from nodlidar_planner.sweeps.schedule import even_rows, Schedule
import numpy as np

# A choice needs this time [s]: to be computed, and to reach the servo before the reversal.
LEAST_NOTICE = 0.04
# It is made at most this many scans before the reversal: each scan is an occasion to choose.
MOST_SCANS = 1.5
# Cells unseen after this time [s] are out of reach: the next round begins.
LONGEST_ROUND = 60.0
# Sweeps that are remembered: scans are seconds late at most.
MOST_COMMANDED = 64


class ChosenSweeps:
    """Chooses one sweep after the other; when all cells are seen, the next round begins.

    Parameters
    ----------
    task
        Limits of the nod, lidar and cells; rows are evened out.
    planned
        The nod to begin with; durations stay near its own.
    timing_error
        Standard deviation of the instants of the reversals [s].
    fewest_samples
        N_s at the highest speed of the servo.
    schedule
        Sweeps to use in turn instead of choosing them, the first one up.

    Attributes
    ----------
    rounds, round_time
        Number of complete rounds, and duration of the last one [s]; NaN before the first.
    """

    def __init__(
        self,
        task: Task,
        planned: Nod,
        timing_error: float,
        fewest_samples: int,
        schedule: Schedule | None = None,
    ) -> None:
        n_s = planned.samples_per_sweep
        self._feedback = Feedback(even_rows(task), n_s, timing_error, fewest_samples)
        self._task = task
        self._schedule, self._next = schedule, 0
        # Sweeps that later beams may belong to, with the instants [ns] at which they begin.
        self._commanded = deque([(planned.reference_time_ns, planned)], maxlen=MOST_COMMANDED)
        self.rounds, self.round_time = 0, math.nan
        self._round_ns: int | None = None

    @property
    def nod(self) -> Nod:
        """The sweep that was chosen last."""
        return self._commanded[-1][1]

    @property
    def start_ns(self) -> int:
        """When it begins [ns]."""
        return self._commanded[-1][0]

    def nod_at(self, time_ns: int) -> Nod:
        """Return the nod at an instant [ns]: the one chosen last may begin later."""
        begun = (nod for start_ns, nod in reversed(self._commanded) if start_ns <= time_ns)
        return next(begun, self.nod)

    def shift(self, step_ns: int) -> None:
        """Continue as before after the clock was set by a step [ns]."""
        for k, (start_ns, nod) in enumerate(self._commanded):
            self._commanded[k] = start_ns + step_ns, nod.shifted(step_ns)
        if self._round_ns is not None:
            self._round_ns += step_ns

    def add_beams(
        self,
        times_ns: Times,
        azimuth: Array,
        pitch: Array,
    ) -> None:
        """Mark the cells that beams hit; without a schedule, also note how the servo lags.

        Parameters
        ----------
        times_ns
            Instants of all beams of a scan [ns], with or without a measurement, shape (n,).
        azimuth, pitch
            Their directions [rad], shape (n,).
        """
        end_ns = int(times_ns[-1])
        while len(self._commanded) > 1 and self._commanded[1][0] <= times_ns[0]:
            self._commanded.popleft()
        if self._schedule is None:
            self._measure(times_ns, pitch)
        if self._round_ns is None:
            self._round_ns = end_ns
        self._feedback.saw_beams(azimuth, pitch)
        complete = not self._feedback.unseen.any()
        duration = (end_ns - self._round_ns) / NS_PER_S
        if complete:
            self.rounds, self.round_time = self.rounds + 1, duration
        if complete or duration > LONGEST_ROUND:
            self._feedback.forget()
            self._round_ns = end_ns

    def _measure(self, times_ns: Times, pitch: Array) -> None:
        """Note the lag of the servo in the sweeps that the beams belong to.

        The pitch may be estimated so late that other sweeps were chosen meanwhile.
        """
        sweeps, duration = np.empty_like(pitch), np.empty_like(pitch)
        for number, (start_ns, nod) in enumerate(self._commanded):
            later = slice(int(np.searchsorted(times_ns, start_ns)) if number else 0, None)
            sweeps[later], duration[later] = nod.sweeps(times_ns[later]), nod.samples_per_sweep
        leg = np.floor(sweeps)
        progress = (pitch - self.nod.pitch_min) / self.nod.span
        progress = np.where(leg % 2.0 == 0.0, progress, 1.0 - progress)
        self._feedback.lateness.add((sweeps - leg) * duration, duration, progress)

    def choose(self, now_ns: int, lidar: Revolutions, geometry: ScanGeometry) -> bool:
        """Choose the next sweep if it is time to; return whether it was.

        Parameters
        ----------
        now_ns
            The present time [ns].
        lidar, geometry
            Its revolutions, and the geometry of its scans.

        Raises
        ------
        ParameterError
            If there is no schedule and the lidar turns to the right: cells must be passed to the
            left.
        """
        if geometry.angle_increment < 0.0 and self._schedule is None:
            limit = "positive for nod_mode 'feedback'"
            raise ParameterError('angle_increment', limit, geometry.angle_increment)
        leg = math.floor(self.nod.sweep_at(now_ns))
        begin_ns, reversal_ns = self.nod.reversal_time_ns(leg), self.nod.reversal_time_ns(leg + 1)
        notice = (reversal_ns - now_ns) / NS_PER_S
        longest = LEAST_NOTICE + MOST_SCANS * lidar.period
        if self.start_ns > now_ns or not LEAST_NOTICE < notice <= longest:
            return False
        going_up = leg % 2 == 1
        beam_period = lidar.period / self._task.steps_per_revolution
        begin, reversal = (self._sample(t, lidar, geometry) for t in (begin_ns, reversal_ns))
        duration = self._duration(reversal, going_up, under_way=(begin, reversal - begin))
        sweep = duration * beam_period
        chosen = replace(
            self.nod,
            sweep_duration=sweep,
            samples_per_sweep=round(duration),
            reference_time_ns=reversal_ns - (0 if going_up else round(sweep * NS_PER_S)),
        )
        self._commanded.append((reversal_ns, chosen))
        return True

    def _duration(self, reversal: float, going_up: bool, under_way: tuple[float, float]) -> float:
        """Return the duration of the next sweep, in samples; see Feedback.next_duration."""
        if self._schedule is None:
            return self._feedback.next_duration(reversal, going_up, under_way)
        sweeps = self._schedule.sweeps
        if going_up != (self._next % 2 == 0):  # one was missed: it was too late
            self._next += 1
        duration = sweeps[self._next % len(sweeps)]
        self._next += 1
        return float(duration)

    def _sample(self, time_ns: int, lidar: Revolutions, geometry: ScanGeometry) -> float:
        """Return the sample at an instant [ns]; modulo N_L it is the lidar's step."""
        steps = self._task.steps_per_revolution
        first = int(self._task.step_at(geometry.angle_min))
        return first + (time_ns - lidar.begin_ns) * steps / (lidar.period * NS_PER_S)
