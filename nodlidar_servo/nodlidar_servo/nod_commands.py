"""Which nod command counts: accepted ones, for as long as commands keep coming."""

import math

from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NodTrajectory, NS_PER_S
from nodlidar_servo.config import ServoConfig
from nodlidar_servo.models import MODELS
from nodlidar_servo.tracking import check_nod, Dynamics, NodTracker

FARTHEST_START = 60.0
"""A command may be given so long before it counts [s]: what is for later is a mistake."""


class NodCommands:
    """The latest accepted nod command and what became of the others.

    Its times are those of a steady clock: a host's clock that is set neither ends a command nor
    keeps it. Only the commands themselves are in terms of the host's clock.

    Attributes
    ----------
    refused
        Commands that were refused so far.
    refusal
        Why the last of them was refused; empty if none was.
    """

    def __init__(self, config: ServoConfig) -> None:
        model = MODELS[config.model]
        self._config = config
        self._dynamics = Dynamics(config.acceleration, model.speed_unit, model.fastest)
        self._tracker: NodTracker | None = None
        self._upcoming: tuple[int, NodTrajectory] | None = None
        self._received_ns: int | None = None
        self._refused_for = '', ''
        self.refused = 0
        self.refusal = ''

    def accept(self, nod: NodTrajectory, now_ns: int, start_ns: int = 0) -> None:
        """Follow a nod, from wherever the servo is; each accepted command is a sign of life.

        Parameters
        ----------
        nod
            The command.
        now_ns
            The present time [ns].
        start_ns
            Until when [ns] the command before it counts, if there is one.

        Raises
        ------
        ParameterError
            If the mount or the servo cannot do it, or it is for later than FARTHEST_START; the
            former command then stays.
        """
        config = self._config
        check_nod(nod, config.pitch_lower_limit, config.pitch_upper_limit, self._dynamics)
        if start_ns - now_ns > FARTHEST_START * NS_PER_S:
            ahead = f'at most {FARTHEST_START:g} s from now'
            raise ParameterError('start_time', ahead, (start_ns - now_ns) / NS_PER_S)
        if self.tracker(now_ns) is None:
            start_ns = 0
        if self._tracker is None:
            self._tracker = NodTracker(nod, self._dynamics)
        self._upcoming = (start_ns, nod)
        self._received_ns = now_ns

    def refuse(self, error: ParameterError) -> bool:
        """Count a refused command, which is no sign of life; return whether the reason is new.

        Good and bad commands may alternate, if they come from two publishers, and the value that
        is beyond a limit may be another each time.
        """
        reason = error.key, error.limit
        new = reason != self._refused_for
        self.refused += 1
        self.refusal, self._refused_for = str(error), reason
        return new

    def age(self, now_ns: int) -> float:
        """Return the time since the latest accepted command [s]; infinite if there was none."""
        return math.inf if self._received_ns is None else (now_ns - self._received_ns) / NS_PER_S

    def tracker(self, now_ns: int) -> NodTracker | None:
        """Return what follows the present command; None if there is none or they have stopped."""
        if self.age(now_ns) > self._config.command_timeout:
            return None
        if self._tracker is None or self._upcoming is None:
            return None
        start_ns, nod = self._upcoming
        if now_ns >= start_ns - self._tracker.phase.lead_ns:
            self._tracker.nod = nod
        return self._tracker
