"""The servo's cycle: wait, measure, steer."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import NodProgress
from nodlidar_servo.bus.replies import LateReplyError, ReplyError
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.following import Following
from nodlidar_servo.held_samples import HeldSamples
from nodlidar_servo.nod.nod_commands import NodCommands

_DOUBT = 0.05  # s; longest doubt about a sample, or two cycles if longer

LOST_AFTER = 0.5
"""A servo is lost after this time [s] and FEWEST_FAILURES without a measurement."""

FEWEST_FAILURES = 5

_LATEST_STEERING = 0.25  # s; without a newer sample the servo keeps its goal


class Schedule:
    """Absolute deadlines at a fixed period, so that delays do not accumulate.

    A deadline that passed less than a period ago is due at once; whole periods that have passed
    are skipped. The schedule restarts if the clock goes back.
    """

    def __init__(self, rate: float) -> None:
        self.period_ns = round(NS_PER_S / rate)
        self._deadline_ns: int | None = None

    def advance(self, now_ns: int) -> tuple[int, int]:
        """Return the next deadline [ns] and how many were skipped before it."""
        if self._deadline_ns is None or now_ns < self._deadline_ns - self.period_ns:
            self._deadline_ns = now_ns
            return now_ns, 0
        deadline_ns = self._deadline_ns + self.period_ns
        skipped = max(now_ns - deadline_ns, 0) // self.period_ns
        self._deadline_ns = deadline_ns + skipped * self.period_ns
        return self._deadline_ns, skipped


@dataclass(slots=True)
class LoopFigures:
    """Counts of the cycles, over all connections; failures by reason."""

    samples: int = 0  # that were believed
    failures: Counter[str] = field(default_factory=Counter)
    saturated_cycles: int = 0
    missed_cycles: int = 0
    withheld: int = 0

    def withhold(self, samples: int) -> None:
        """Count samples that were not believed."""
        self.withheld += samples

    def copy(self) -> 'LoopFigures':
        """Return the present counts."""
        return replace(self, failures=self.failures.copy())


class ServoLoop:
    """Measures at a fixed rate and keeps the servo on the commanded nod.

    Parameters
    ----------
    servo
        The connected servo.
    commands
        The nod commands.
    following
        Checks whether the servo follows.
    rate
        Cycles per second [Hz].
    figures
        Counts the cycles.
    clock, sleep
        Return the host time [ns]; block for a time [ns].
    steady
        Returns the time of a steady clock [ns], which times cycles and commands; `clock` by
        default.

    Attributes
    ----------
    progress
        How the nod is followed; None without a nod command, or if all replies are late: the
        torque is then off.
    sample
        The latest measurement, believed or not; None before the first.
    """

    def __init__(
        self,
        servo: Servo,
        commands: NodCommands,
        following: Following,
        rate: float,
        figures: LoopFigures,
        clock: Callable[[], int],
        sleep: Callable[[int], None],
        steady: Callable[[], int] | None = None,
    ) -> None:
        self._servo = servo
        self._commands = commands
        self._following = following
        self._figures = figures
        self._schedule = Schedule(rate)
        doubt_ns = max(round(_DOUBT * NS_PER_S), 2 * self._schedule.period_ns)
        self._held = HeldSamples(doubt_ns, figures.withhold)
        self._clock = clock
        self._sleep = sleep
        self._steady = steady or clock
        self.progress: NodProgress | None = None
        self.sample: Sample | None = None
        self._measured_ns = 0
        self._late = 0  # late replies since the latest sample
        self._heard()

    def cycle(self) -> list[Sample]:
        """Wait for the next cycle, measure, again while that fails early, and steer.

        Returns
        -------
        list of Sample
            New samples in the order of time: none if measuring failed, or the sample is not
            believed yet.

        Raises
        ------
        DeviceError
            If the port fails, or the servo has not answered for LOST_AFTER.
        """
        deadline_ns, skipped = self._schedule.advance(self._steady())
        self._figures.missed_cycles += skipped
        self._steer_at_reversal(deadline_ns)
        self._wait_until(deadline_ns)
        measured = self._attempt(self._measure)
        while not measured and self._may_repeat(deadline_ns):
            measured = self._attempt(self._measure)
        self._attempt(self._steer)
        if not measured or self.sample is None:
            return []
        believed = self._held.add(self.sample, self._following.believed)
        self._figures.samples += len(believed)
        return believed

    def _may_repeat(self, deadline_ns: int) -> bool:
        """Return whether there is time to repeat the first request that failed, or late ones."""
        return self._failures <= 1 and self._steady() - deadline_ns < self._schedule.period_ns

    def _steer_at_reversal(self, deadline_ns: int) -> None:
        """Steer at the instant of a reversal that comes before the next cycle."""
        steady_ns, now_ns = self._steady(), self._clock()
        tracker = self._commands.follow(steady_ns)
        if tracker is None:
            return
        reversal_ns = steady_ns + tracker.next_reversal_ns(now_ns) - now_ns
        if reversal_ns < deadline_ns:
            self._wait_until(reversal_ns)
            self._attempt(self._steer)

    def _wait_until(self, time_ns: int) -> None:
        """Block until a steady time [ns], for at most a period."""
        self._sleep(min(max(time_ns - self._steady(), 0), self._schedule.period_ns))

    def _measure(self) -> None:
        self.sample = self._servo.read()
        self._measured_ns = self._steady()
        self._late = 0
        self._heard()
        self._following.measured(self._measured_ns, self.sample.pitch)

    def _heard(self) -> None:
        self._failures, self._heard_ns = 0, self._steady()

    def _since(self, steady_ns: int) -> float:
        """Return the time since a steady time [s]."""
        return (self._steady() - steady_ns) / NS_PER_S

    def _steer(self) -> None:
        steady_ns, now_ns = self._steady(), self._clock()
        tracker = self._commands.follow(steady_ns)
        if tracker is None:
            self._following.forget()
        if self._is_blind():
            tracker = self.progress = None
        if tracker is None or not self._following.may_drive(steady_ns):
            self._following.rest()
            if self._servo.torque:
                self._servo.set_torque(False)
        elif self.sample is not None and self._since(self._measured_ns) < _LATEST_STEERING:
            drive = tracker.step(now_ns, self.sample)
            self._servo.drive(drive.goal, drive.speed)
            self._following.drive(steady_ns, drive, tracker.nod, self.sample)
            self._figures.saturated_cycles += drive.saturated
        self.progress = None if tracker is None else tracker.progress()

    def _is_blind(self) -> bool:
        """Return whether late replies have left no sample for LOST_AFTER."""
        return self._late >= FEWEST_FAILURES and self._since(self._measured_ns) > LOST_AFTER

    def _attempt(self, step: Callable[[], None]) -> bool:
        """Do a step; return whether it succeeded. Raise a failure only if it lasts."""
        try:
            step()
        except ReplyError as error:
            self._figures.failures[error.reason] += 1
            self._failures += 1
            if isinstance(error, LateReplyError):
                self._late += 1
                self._heard()
            if self._failures >= FEWEST_FAILURES and self._since(self._heard_ns) > LOST_AFTER:
                raise
            return False
        return True
