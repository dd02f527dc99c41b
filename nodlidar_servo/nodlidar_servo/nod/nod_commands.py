"""The nod command in effect: the latest accepted one, while commands keep coming."""

from dataclasses import dataclass, replace
import math

from nodlidar_common.dynamics import check_nod
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.phase import LOCKED
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import NodTracker
from nodlidar_servo.nod.joint_config import JointConfig

FARTHEST_START = 60.0
"""A command may precede its start by up to this time [s]; a later start is a mistake."""

KNOWN = 5.0
"""Time [s] for which the same fault of refused commands is not news."""


@dataclass(frozen=True, slots=True)
class Command:
    """An accepted nod command.

    Attributes
    ----------
    nod
        The commanded nod.
    start_ns
        When it takes effect, by the clock of the starts [ns].
    received_ns
        When it was received [ns].
    former
        The command in effect until then; None if there is none.
    """

    nod: Nod
    start_ns: int
    received_ns: int
    former: 'Command | None' = None

    def age(self, now_ns: int) -> float:
        """Return the time since it was received [s], at a time [ns]."""
        return (now_ns - self.received_ns) / NS_PER_S

    def in_effect(self, now_ns: int) -> Nod | None:
        """Return the nod in effect at a time [ns]; None if it is older than `former`."""
        if now_ns >= self.start_ns:
            return self.nod
        return None if self.former is None else self.former.in_effect(now_ns)


class NodCommands:
    """The latest accepted nod command, and counts of the refused ones.

    One thread receives the commands, another one follows them by :meth:`follow`; what the first
    passes to the second is one :class:`Command`. Times are those of a steady clock: a step of the
    host's clock neither ends nor prolongs a command. Only the nods are in host time, and where
    that is simulated, at any rate, so are the starts of commands, `clock_ns`; by default they are
    of the steady clock, too.

    Attributes
    ----------
    refused
        Commands that were refused so far.
    refusal
        Why the last of them was refused; empty if there was none.
    """

    def __init__(self, config: JointConfig) -> None:
        self._config = config
        self._dynamics = config.dynamics
        self._tracker: NodTracker | None = None
        self._latest: Command | None = None
        self._refused_for, self._refused_ns = '', 0
        self.refused = 0
        self.refusal = ''

    def accept(
        self, nod: Nod, now_ns: int, start_ns: int = 0, clock_ns: int | None = None
    ) -> None:
        """Accept a command, which is a sign of life.

        Parameters
        ----------
        nod
            The commanded nod.
        now_ns
            The present time [ns].
        start_ns
            When it takes effect [ns]; at once, if there is no current command.
        clock_ns
            The present time by the clock of the starts [ns].

        Raises
        ------
        ParameterError
            If the mount or the servo cannot follow it, or its start is later than FARTHEST_START;
            the former command then stays in effect.
        """
        config = self._config
        check_nod(nod, config.pitch_lower_limit, config.pitch_upper_limit, self._dynamics)
        clock_ns = now_ns if clock_ns is None else clock_ns
        if start_ns - clock_ns > FARTHEST_START * NS_PER_S:
            ahead = f'at most {FARTHEST_START:g} s from now'
            raise ParameterError('start_time', ahead, (start_ns - clock_ns) / NS_PER_S)
        former = self._current(now_ns)
        if former is None:
            start_ns = 0
        elif clock_ns < former.start_ns - LOCKED * NS_PER_S:
            former = former.former  # it never takes effect
        else:
            former = replace(former, former=None)
        self._latest = Command(nod, start_ns, now_ns, former)

    def refuse(self, error: ParameterError, now_ns: int) -> bool:
        """Count a refused command, which is not a sign of life; return whether its fault is news.

        Good and bad commands may alternate, if they come from two publishers. A value beyond a
        limit, and a limit that follows from other values, may change each time.
        """
        known = now_ns - self._refused_ns < KNOWN * NS_PER_S and error.key == self._refused_for
        self.refused += 1
        self.refusal, self._refused_for, self._refused_ns = str(error), error.key, now_ns
        return not known

    def age(self, now_ns: int) -> float:
        """Return the time since the latest accepted command [s]; infinite if there was none."""
        return math.inf if self._latest is None else self._latest.age(now_ns)

    def are_current(self, now_ns: int) -> bool:
        """Return whether there is a command to follow at a time [ns]."""
        return self._current(now_ns) is not None

    def follow(self, now_ns: int, clock_ns: int | None = None) -> NodTracker | None:
        """Return the tracker, changed to the nod in effect at a time [ns]; None without a command.

        Only for the thread that drives the servo. See `accept` for the times.
        """
        command = self._current(now_ns)
        if command is None:
            return None
        if self._tracker is None:
            self._tracker = NodTracker(command.nod, self._dynamics)
        clock_ns = now_ns if clock_ns is None else clock_ns
        nod = command.in_effect(clock_ns + self._tracker.phase.lead_ns)
        self._tracker.nod = nod or self._tracker.nod
        return self._tracker

    def next(self, now_ns: int) -> tuple[Nod, int] | None:
        """Return the nod that replaces the followed one, and its start [ns]; None if none does."""
        command = self._current(now_ns)
        if command is None or self._tracker is None or command.nod is self._tracker.nod:
            return None
        return command.nod, command.start_ns

    def _current(self, now_ns: int) -> Command | None:
        """Return the latest command, unless it is too old at a time [ns]."""
        latest = self._latest
        if latest is None or latest.age(now_ns) > self._config.command_timeout:
            return None
        return latest
