"""Texts from the environment: variables, executables, and what commands print."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from typing import TYPE_CHECKING

from ..frontend import expose_substitution
from ..logging import get_logger
from ..substitution import SomeSubstitutionsType, Substitution
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions
from .substitution_failure import SubstitutionFailure
from .text import describe_all

if TYPE_CHECKING:
    from ..launch_context import LaunchContext


@expose_substitution('env')
class EnvironmentVariable(Substitution):
    """The value of an environment variable."""

    def __init__(
        self,
        name: SomeSubstitutionsType,
        *,
        default_value: SomeSubstitutionsType | None = None,
    ) -> None:
        self.name = normalize_to_list_of_substitutions(name)
        self.default_value = (
            None if default_value is None else normalize_to_list_of_substitutions(default_value)
        )

    def describe(self) -> str:
        """Name the variable."""
        return f'EnvVar({describe_all(self.name)})'

    def perform(self, context: LaunchContext) -> str:
        """Return the variable, or the default where it isn't set."""
        name = perform_substitutions(context, self.name)
        if name in context.environment:
            return context.environment[name]
        if self.default_value is None:
            raise SubstitutionFailure(f"environment variable '{name}' does not exist")
        return perform_substitutions(context, self.default_value)


@expose_substitution('find-exec')
class FindExecutable(Substitution):
    """The path of an executable on the PATH."""

    def __init__(self, *, name: SomeSubstitutionsType) -> None:
        self.name = normalize_to_list_of_substitutions(name)

    def describe(self) -> str:
        """Name the executable."""
        return f'FindExec({describe_all(self.name)})'

    def perform(self, context: LaunchContext) -> str:
        """Look on the PATH."""
        name = perform_substitutions(context, self.name)
        path = shutil.which(name)
        if path is None:
            raise SubstitutionFailure(f"executable '{name}' not found on the PATH")
        return path


@expose_substitution('command')
class Command(Substitution):
    """What a command prints.

    Parameters
    ----------
    command
        The command line, split as a shell does.
    on_stderr
        What output on stderr means: 'fail', 'ignore', 'warn' or 'capture' (as if on stdout).

    """

    def __init__(
        self, command: SomeSubstitutionsType, *, on_stderr: SomeSubstitutionsType = 'fail'
    ) -> None:
        self.command = normalize_to_list_of_substitutions(command)
        self.on_stderr = normalize_to_list_of_substitutions(on_stderr)

    def describe(self) -> str:
        """Describe the command line."""
        return f'Command({describe_all(self.command)})'

    def perform(self, context: LaunchContext) -> str:
        """Run the command, and return its output as it is."""
        command = perform_substitutions(context, self.command)
        on_stderr = perform_substitutions(context, self.on_stderr)
        if on_stderr not in ('fail', 'ignore', 'warn', 'capture'):
            raise SubstitutionFailure(
                "expected 'on_stderr' to be one of: 'fail', 'ignore', 'warn' or 'capture'"
            )
        return _run(command, on_stderr)


def _run(command: str, on_stderr: str) -> str:
    stderr = subprocess.STDOUT if on_stderr == 'capture' else subprocess.PIPE
    try:
        result = subprocess.run(
            shlex.split(command), stdout=subprocess.PIPE, stderr=stderr, text=True, check=False
        )
    except FileNotFoundError as error:
        raise SubstitutionFailure(f'file not found: {error}') from error
    captured = f'\nCaptured stderr output: {result.stderr}' if result.stderr else ''
    if result.returncode != 0:
        raise SubstitutionFailure(f'executed command failed. Command: {command}{captured}')
    message = f'executed command showed stderr output. Command: {command}{captured}'
    if captured and on_stderr == 'fail':
        raise SubstitutionFailure(message)
    if captured and on_stderr == 'warn':
        get_logger('launch').warning(message)
    return result.stdout
