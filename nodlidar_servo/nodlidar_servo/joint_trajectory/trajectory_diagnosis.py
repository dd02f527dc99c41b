"""What the node reports about a joint that ros2_control moves."""

from collections import Counter
from dataclasses import dataclass
import math

from nodlidar_common.recent import Recent
from nodlidar_common.report import Report
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.tracking import NodProgress
from nodlidar_servo.nod.command_report import CommandReport, phase_figures
from nodlidar_servo.nod.nod_commands import NodCommands

_WINDOW, _SHORTEST = 1.5, 1.0  # s, that rates are taken over, and at least
_STATES, _REFUSED = 'joint states', 'joint states with a wrong stamp'
_IMPOSSIBLE = 'joint states with an impossible position'
_LONGEST_WAY = 5.0  # s to the nod, and more if a sweep is longer


@dataclass(frozen=True, slots=True)
class NodJointState:
    """What the thread that sends trajectories passes on: replaced as a whole."""

    samples: int = 0  # so far
    refused: int = 0  # for their stamps, so far
    impossible: int = 0  # for their positions, so far
    stamp_error: float = 0.0  # s, by which stamps are too early, at least
    offset: float = 0.0  # rad, by which it is measured above the nod
    pitch: float = math.nan  # rad
    is_outside: bool = False  # of the limits of the mount
    progress: NodProgress | None = None
    follow_by_ns: int | None = None  # steady time by when the joint has to be on the nod


class OffNod:
    """Tells by when a joint that is not on its nod has to be: until it follows for a whole sweep.

    The nod passes a joint that stands still once in each sweep. If the nod changes meanwhile, as
    after a region was scanned, the slowest one counts.
    """

    def __init__(self) -> None:
        self._off_ns: int | None = None
        self._on_ns: int | None = None
        self._sweep = 0.0  # the longest since it is off the nod [s]

    def follow_by(self, follows: bool, now_ns: int, sweep: float) -> int | None:
        """Return the time [ns]; None if it is on the nod, whose sweep takes so long [s]."""
        if not follows:
            self._on_ns = None
            self._off_ns = now_ns if self._off_ns is None else self._off_ns
        else:
            self._on_ns = now_ns if self._on_ns is None else self._on_ns
            if now_ns - self._on_ns >= sweep * NS_PER_S:
                self._off_ns, self._sweep = None, 0.0
        if self._off_ns is None:
            return None
        self._sweep = max(self._sweep, sweep)
        way = max(_LONGEST_WAY, 4.0 * self._sweep)
        return self._off_ns + round((way + self._sweep) * NS_PER_S)  # the last one, it follows


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
        refusals = {_REFUSED: state.refused, _IMPOSSIBLE: state.impossible}
        self._recent.add(now_ns, Counter({_STATES: state.samples, **refusals}))
        duration = self._recent.duration
        rate = self._recent.counts[_STATES] / duration if duration >= _SHORTEST else 0.0
        figures = {'joint states per second': f'{rate:.1f}', 'pitch [rad]': f'{state.pitch:.4f}'}
        figures |= self._commands.figures(now_ns) | phase_figures(state.progress)
        figures |= {what: str(count) for what, count in refusals.items()}
        warnings = self._commands.new_refusals()
        counts = self._recent.counts
        warnings += [f'{counts[what]} {what}' for what in refusals if counts[what]]
        if state.stamp_error:
            is_early = state.stamp_error > 0.0
            way, unless = (
                ('before', ', unless they travel that long') if is_early else ('after', '')
            )
            warnings.append(
                f'joint states are stamped at least {abs(state.stamp_error):.2f} s {way} they '
                f'arrive, and clouds are wrong by as much{unless}: synchronise the clocks, or '
                'correct their publisher'
            )
        if state.offset:
            warnings.append(
                f'the joint is measured {state.offset:+.2f} rad off the nod, up and down alike: '
                'the zero of joint states or of the actuator is wrong; doctor says if clouds are'
            )
        if state.is_outside:
            warnings.append(f'the joint is at {state.pitch:.2f} rad, outside of the mount')
        if not self._commands.are_current(now_ns):
            warnings.append('no nod command to follow: the joint is stopped')
        return Report(figures, tuple(warnings), self._errors(now_ns))

    def _errors(self, now_ns: int) -> tuple[str, ...]:
        by_ns = self.state.follow_by_ns
        if by_ns is None or now_ns <= by_ns:
            return ()
        return ('the joint does not follow the trajectory: see what the controller reports',)
