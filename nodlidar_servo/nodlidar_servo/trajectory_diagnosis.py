"""What the node reports about a joint that ros2_control moves."""

from collections import Counter
from dataclasses import dataclass
import math

from nodlidar_common.recent import Recent
from nodlidar_common.report import Report
from nodlidar_common.tracking import Progress
from nodlidar_servo.command_report import CommandReport, phase_figures
from nodlidar_servo.nod_commands import NodCommands

_WINDOW, _SHORTEST = 1.5, 1.0  # s, that rates are taken over, and at least
_STATES = 'joint states'
_LONGEST_WAY = 5.0  # s to the nod, and more if a sweep is longer


@dataclass(frozen=True, slots=True)
class NodJointState:
    """What the thread that sends trajectories passes on: replaced as a whole."""

    samples: int = 0  # so far
    pitch: float = math.nan  # rad
    progress: Progress | None = None
    off_since_ns: int | None = None  # steady time since when the joint is not on the nod


class TrajectoryDiagnosis:
    """Reports the joint's state.

    Attributes
    ----------
    state
        The latest state, for any thread.
    """

    def __init__(self, commands: NodCommands) -> None:
        self.state = NodJointState()
        self._commands = CommandReport(commands)
        self._recent = Recent(_WINDOW)

    def urgent(self, now_ns: int) -> object:
        """Return whether there is a command and the joint follows it, at a time [ns]."""
        return self._commands.are_current(now_ns), self._errors(now_ns)

    def next_report(self, now_ns: int) -> Report:
        """Return the state at a time [ns] of the steady clock."""
        state = self.state
        self._recent.add(now_ns, Counter({_STATES: state.samples}))
        duration = self._recent.duration
        rate = self._recent.counts[_STATES] / duration if duration >= _SHORTEST else 0.0
        figures = {'joint states per second': f'{rate:.1f}', 'pitch [rad]': f'{state.pitch:.4f}'}
        figures |= self._commands.figures(now_ns) | phase_figures(state.progress)
        warnings = self._commands.new_refusals()
        if not self._commands.are_current(now_ns):
            warnings.append('no nod command to follow: the joint is stopped')
        return Report(figures, tuple(warnings), self._errors(now_ns))

    def _errors(self, now_ns: int) -> tuple[str, ...]:
        state = self.state
        if state.progress is None or state.off_since_ns is None:
            return ()
        longest = max(_LONGEST_WAY, 4.0 * state.progress.nod.sweep_duration)
        if (now_ns - state.off_since_ns) / 1e9 <= longest:
            return ()
        return ('the joint does not follow the trajectory: see what the controller reports',)
