"""What the servo reports about itself, and what of it is out of order."""

from nodlidar_servo.following import Following
from nodlidar_servo.nod_commands import NodCommands
from nodlidar_servo.recent import Recent
from nodlidar_servo.replies import LateReplyError, status_names
from nodlidar_servo.sample import Sample
from nodlidar_servo.servo import Servo
from nodlidar_servo.servo_loop import LoopFigures

LOW_RATE = 0.9
"""Below this share of the rate that is asked for, joint states come too seldom."""

MANY_LATE = 0.1
"""Above this share of late replies the host is too busy; any other failure is one of the bus."""


class Diagnosis:
    """Turns the figures of the loop and the latest sample into text.

    A report may be asked for by another thread than the one that tells what happens.

    Attributes
    ----------
    sample
        The latest sample; None while not connected.
    """

    def __init__(
        self,
        figures: LoopFigures,
        commands: NodCommands,
        following: Following,
        feedback_rate: float,
    ) -> None:
        self._figures = figures
        self._commands = commands
        self._following = following
        self._feedback_rate = feedback_rate
        self._recent = Recent()
        self._servo: Servo | None = None
        self._latency_warning = ''
        self._refused_told = 0
        self.sample: Sample | None = None

    def connected(self, servo: Servo, latency_warning: str) -> None:
        """Report about this servo from now on."""
        self._recent.clear()
        self._servo = servo
        self._latency_warning = latency_warning

    def disconnected(self) -> None:
        """Report only what has been counted, until connected again."""
        self._servo = self.sample = None
        self._latency_warning = ''

    def report(
        self, now_ns: int, commanders: int = 1
    ) -> tuple[dict[str, str], list[str], list[str]]:
        """Return the figures by name, the warnings and the errors.

        Parameters
        ----------
        now_ns
            Time of the steady clock [ns].
        commanders
            How many publish nod commands: the servo follows whoever came last.
        """
        servo, sample = self._servo, self.sample
        self._recent.look(now_ns, self._figures.samples, self._figures.failures)
        figures, warnings = self._counted(now_ns), self._command_warnings(servo, now_ns)
        if servo is not None:
            warnings += self._rate_warnings()
        if commanders > 1:
            warnings.append(f'nod commands come from {commanders} publishers')
        errors = [self._following.fault] if self._following.fault else []
        if servo is not None and sample is not None:
            figures |= self._measured(servo, sample)
            warnings += _out_of_limits(servo, sample)
            errors += _alarms(servo, sample)
        if self._latency_warning:
            warnings.append(self._latency_warning)
        return figures, warnings, errors

    def urgent(self, now_ns: int) -> object:
        """Return what is told at once when it changes, at a time [ns] of the steady clock."""
        alarms = (self._servo.shut_down, self.sample.status) if self._servo and self.sample else ()
        failures = self._figures.failures
        failed = failures.total() - failures[LateReplyError.reason]
        commanded = self._commands.tracker(now_ns) is not None
        return self._following.fault, alarms, failed, commanded

    def _counted(self, now_ns: int) -> dict[str, str]:
        counted = self._figures
        figures = {
            'joint states per second': f'{self._rate:.1f}',
            'joint states withheld': str(counted.withheld),
            'missed cycles': str(counted.missed_cycles),
            'cycles at the speed limit': str(counted.saturated_cycles),
            'command age [s]': f'{self._commands.age(now_ns):.2f}',
            'refused commands': str(self._commands.refused),
        }
        figures |= self._phase(now_ns)
        failures = sorted(counted.failures.items())
        return figures | {f'failed: {reason}': str(count) for reason, count in failures}

    def _phase(self, now_ns: int) -> dict[str, str]:
        tracker = self._commands.tracker(now_ns)
        if tracker is None:
            return {}
        nod, phase = tracker.nod, tracker.phase
        return {
            'samples per sweep, commanded': str(nod.samples_per_sweep),
            'samples per sweep, measured': (
                f'{nod.samples_per_sweep * phase.drift.measured_ratio:.2f}'
            ),
            'phase error [ms]': f'{phase.error * 1e3:.2f}',
        }

    @property
    def _rate(self) -> float:
        """The samples per second of late."""
        return self._recent.samples / self._recent.duration if self._recent.duration else 0.0

    def _rate_warnings(self) -> list[str]:
        recent, warnings = self._recent, []
        if not recent.duration:
            return []
        if self._rate < LOW_RATE * self._feedback_rate:
            wanted = f'{self._feedback_rate:g}'
            warnings.append(f'{self._rate:.1f} joint states per second, not {wanted}')
        failures = recent.failures
        asked = recent.samples + failures.total()
        for reason, count in failures.items():
            if count > (MANY_LATE * asked if reason == LateReplyError.reason else 0):
                warnings.append(f'{count / asked:.1%} of the replies failed: {reason}')
        return warnings

    def _command_warnings(self, servo: Servo | None, now_ns: int) -> list[str]:
        warnings = []
        if self._commands.refused > self._refused_told:
            warnings.append(f'nod command refused: {self._commands.refusal}')
        self._refused_told = self._commands.refused
        if servo is not None and self._commands.tracker(now_ns) is None:
            torque = 'it is not confirmed that the torque is off' if servo.torque else 'torque off'
            warnings.append(f'no nod command to follow: {torque}')
        return warnings

    @staticmethod
    def _measured(servo: Servo, sample: Sample) -> dict[str, str]:
        return {
            'torque': 'on' if servo.torque else 'off',
            'pitch [rad]': f'{sample.pitch:.4f}',
            'load [share of maximum]': f'{sample.load:.2f}',
            'voltage [V]': f'{sample.voltage:.1f}',
            'temperature [deg C]': str(sample.temperature),
        }


def _alarms(servo: Servo, sample: Sample) -> list[str]:
    errors = []
    if sample.status:
        errors.append(f'the servo reports: {status_names(sample.status)}')
    if servo.shut_down:
        names = status_names(servo.shut_down)
        errors.append(f'the servo has shut down ({names}): deactivate and activate the node')
    return errors


def _out_of_limits(servo: Servo, sample: Sample) -> list[str]:
    limits, warnings = servo.limits, []
    if not limits.voltage_min <= sample.voltage <= limits.voltage_max:
        allowed = f'{limits.voltage_min} to {limits.voltage_max} V'
        warnings.append(f'supply is {sample.voltage} V, outside {allowed}')
    if sample.temperature >= limits.temperature:
        warnings.append(f'motor is at {sample.temperature} deg C, limit {limits.temperature}')
    return warnings
