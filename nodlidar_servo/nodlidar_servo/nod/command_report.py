"""What a node reports about its nod commands and the phase."""

from nodlidar_common.tracking import NodProgress
from nodlidar_servo.nod.nod_commands import NodCommands


class CommandReport:
    """Reports about nod commands; times are those of the steady clock [ns]."""

    def __init__(self, commands: NodCommands) -> None:
        self._commands = commands
        self._refused_reported = 0

    def are_current(self, now_ns: int) -> bool:
        """Return whether there is a command to follow at a time."""
        return self._commands.are_current(now_ns)

    def figures(self, now_ns: int) -> dict[str, str]:
        """Return the figures of the commands at a time."""
        return {
            'command age [s]': f'{self._commands.age(now_ns):.2f}',
            'refused commands': str(self._commands.refused),
        }

    def new_refusals(self) -> list[str]:
        """Return why a command was refused since the last call, if any was."""
        refused, self._refused_reported = self._refused_reported, self._commands.refused
        if self._commands.refused == refused:
            return []
        return [f'nod command refused: {self._commands.refusal}']


def phase_figures(progress: NodProgress | None) -> dict[str, str]:
    """Return how a nod is followed."""
    if progress is None:
        return {}
    samples = progress.nod.samples_per_sweep
    return {
        'samples per sweep, commanded': str(samples),
        'samples per sweep, measured': f'{samples * progress.measured_ratio:.2f}',
        'phase error [ms]': f'{progress.phase_error * 1e3:.2f}',
    }
