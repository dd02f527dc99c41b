"""What the node reports about the servo."""

from collections import Counter
from dataclasses import replace
from typing import Any

from nodlidar_common.recent import Recent
from nodlidar_common.report import Report
from nodlidar_common.tracking import NodProgress
from nodlidar_servo.bus.replies import LateReplyError, status_names
from nodlidar_servo.device.sample import Sample
from nodlidar_servo.device.servo import Servo
from nodlidar_servo.following import Following
from nodlidar_servo.nod.command_report import CommandReport, phase_figures
from nodlidar_servo.nod.nod_commands import NodCommands
from nodlidar_servo.servo_loop import LoopFigures
from nodlidar_servo.state import Link, ServoState

LOW_RATE = 0.9
"""Joint states below this share of the requested rate are a warning."""

MANY_LATE = 0.1
"""Late replies above this share are a warning: the host is too busy. So is any other failure."""

_WINDOW, _SHORTEST = 1.5, 1.0  # s, that rates are taken over, and at least
_SAMPLES, _WITHHELD = 'samples', 'withheld'


class Diagnosis:
    """Reports the servo's state; counts are over all connections.

    The device's thread calls `connected`, `cycled` and `disconnected`, the thread of the
    diagnostics `urgent` and `next_report`. Only a :class:`.ServoState` goes from one to the other.

    Parameters
    ----------
    figures, following
        The loop's counts, and whether the servo follows; read in the device's thread only.
    commands
        The nod commands.
    feedback_rate
        Joint states per second that are requested [Hz].

    Attributes
    ----------
    state
        The latest state, for any thread: replaced as a whole.
    """

    def __init__(
        self,
        figures: LoopFigures,
        commands: NodCommands,
        following: Following,
        feedback_rate: float,
    ) -> None:
        self.state = ServoState(figures.copy())
        self._figures = figures
        self._commands = CommandReport(commands)
        self._following = following
        self._feedback_rate = feedback_rate
        self._servo: Servo | None = None
        self._recent = Recent(_WINDOW)

    # The device's thread.

    def connected(self, servo: Servo, latency_warning: str) -> None:
        """Report about this servo from now on."""
        self._servo = servo
        self._update(latency_warning=latency_warning)

    def cycled(self, sample: Sample | None, progress: NodProgress | None) -> None:
        """Report the latest measurement, and how the nod is followed, if there are any."""
        self._update(sample=sample, progress=progress)

    def disconnected(self) -> None:
        """Report only the counts until connected again."""
        self._servo = None
        self._update(latency_warning='', sample=None, progress=None)

    def _update(self, **changes: Any) -> None:
        self.state = replace(
            self.state,
            figures=self._figures.copy(),
            link=Link.of(self._servo) if self._servo else None,
            fault=self._following.fault,
            **changes,
        )

    # The thread of the diagnostics.

    def urgent(self, now_ns: int) -> object:
        """Return faults, alarms and failures, and whether there is a command, at a time [ns]."""
        state = self.state
        failures = state.figures.failures
        failed = failures.total() - failures[LateReplyError.reason]
        return state.fault, _alarms(state), failed, self._commands.are_current(now_ns)

    def next_report(self, now_ns: int) -> Report:
        """Return the state at a time [ns] of the steady clock.

        Commands that were refused since the last report are a warning.
        """
        state, counted = self.state, self.state.figures
        if state.link is None:
            self._recent.clear()
        measured = Counter({_SAMPLES: counted.samples, _WITHHELD: counted.withheld})
        self._recent.add(now_ns, measured + counted.failures)
        warnings = [*self._commands.new_refusals(), *self._command_warnings(state.link, now_ns)]
        warnings += [*self._rate_warnings(), *_out_of_limits(state)]
        if state.latency_warning:
            warnings.append(state.latency_warning)
        fault = [state.fault] if state.fault else []
        figures = self._loop_figures(counted, now_ns)
        figures |= phase_figures(state.progress) | _motor_figures(state)
        return Report(figures, tuple(warnings), (*fault, *_alarms(state)))

    @property
    def _rate(self) -> float:
        """The recent samples per second; 0 while the time is too short to say."""
        duration = self._recent.duration
        return self._recent.counts[_SAMPLES] / duration if duration >= _SHORTEST else 0.0

    def _loop_figures(self, counted: LoopFigures, now_ns: int) -> dict[str, str]:
        figures = {
            'joint states per second': f'{self._rate:.1f}',
            'joint states withheld': str(counted.withheld),
            'missed cycles': str(counted.missed_cycles),
            'cycles at the speed limit': str(counted.saturated_cycles),
        }
        failures = sorted(counted.failures.items())
        return (
            figures
            | self._commands.figures(now_ns)
            | {f'failed: {reason}': str(count) for reason, count in failures}
        )

    def _command_warnings(self, link: Link | None, now_ns: int) -> list[str]:
        if link is None or self._commands.are_current(now_ns):
            return []
        torque = 'it is not confirmed that the torque is off' if link.torque else 'torque off'
        return [f'no nod command to follow: {torque}']

    def _rate_warnings(self) -> list[str]:
        if self._recent.duration < _SHORTEST:
            return []
        warnings = []
        if self._rate < LOW_RATE * self._feedback_rate:
            wanted = f'{self._feedback_rate:g}'
            warnings.append(f'{self._rate:.1f} joint states per second, not {wanted}')
        counts = self._recent.counts
        replies = counts.total()
        for reason, count in counts.most_common():
            if reason == LateReplyError.reason and count <= MANY_LATE * replies:
                continue
            if reason not in (_SAMPLES, _WITHHELD):
                warnings.append(f'{count / replies:.1%} of the replies failed: {reason}')
        return warnings


def _motor_figures(state: ServoState) -> dict[str, str]:
    link, sample = state.link, state.sample
    if link is None or sample is None:
        return {}
    return {
        'torque': 'on' if link.torque else 'off',
        'pitch [rad]': f'{sample.pitch:.4f}',
        'load [share of maximum]': f'{sample.load:.2f}',
        'voltage [V]': f'{sample.voltage:.1f}',
        'temperature [deg C]': str(sample.temperature),
    }


def _alarms(state: ServoState) -> list[str]:
    """Return the errors that the motor reports in its samples."""
    link, sample, errors = state.link, state.sample, []
    if link is None or sample is None:
        return []
    if sample.status:
        errors.append(f'the servo reports: {status_names(sample.status)}')
    if link.shut_down:
        names = status_names(link.shut_down)
        errors.append(f'the servo has shut down ({names}): deactivate and activate the node')
    return errors


def _out_of_limits(state: ServoState) -> list[str]:
    link, sample, warnings = state.link, state.sample, []
    if link is None or sample is None:
        return []
    limits = link.limits
    if not limits.voltage_min <= sample.voltage <= limits.voltage_max:
        allowed = f'{limits.voltage_min} to {limits.voltage_max} V'
        warnings.append(f'supply is {sample.voltage} V, outside {allowed}')
    if sample.temperature >= limits.temperature:
        warnings.append(f'motor is at {sample.temperature} deg C, limit {limits.temperature}')
    return warnings
