"""Texts that are known only while launching."""

from collections.abc import Iterable
import math
import os
import shlex
import subprocess
from typing import Any

from underlay_refusal import refuse, refuse_arguments
import yaml

from .conditions import TRUTHS
from .launch_context import LaunchContext
from .substitution import (
    describe,
    is_substitution,
    normalize,
    perform,
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
)

__all__ = [
    'Command',
    'EqualsSubstitution',
    'IfElseSubstitution',
    'LaunchConfiguration',
    'PathJoinSubstitution',
    'PythonExpression',
    'SubstitutionFailure',
    'TextSubstitution',
]
__getattr__ = refuse(__name__, __all__)


class SubstitutionFailure(RuntimeError):  # noqa: N818
    """A substitution can't be performed."""


class LaunchConfiguration(Substitution):
    """The value of a launch configuration, which launch arguments are too."""

    def __init__(self, variable_name: SomeSubstitutionsType, **uncovered: Any) -> None:
        refuse_arguments('LaunchConfiguration', uncovered)
        self._name = normalize(variable_name)

    def describe(self) -> str:
        """Name the configuration."""
        return f'LaunchConfig({describe(self._name)})'

    def perform(self, context: LaunchContext) -> str:
        """Return the configuration; SubstitutionFailure where it isn't set."""
        name = perform(context, self._name)
        if name not in context.launch_configurations:
            raise SubstitutionFailure(f"launch configuration '{name}' does not exist")
        return context.launch_configurations[name]


class PathJoinSubstitution(Substitution):
    """A path of several parts."""

    def __init__(self, substitutions: Iterable[str | Substitution]) -> None:
        self._parts = normalize(substitutions)

    def describe(self) -> str:
        """Describe the parts."""
        return f"PathJoin('{describe(self._parts)}')"

    def perform(self, context: LaunchContext) -> str:
        """Return the joined path."""
        return os.path.join(*(part.perform(context) for part in self._parts))


class EqualsSubstitution(Substitution):
    """'true' if two texts, truths or numbers are equal, or else 'false'; None is no text."""

    def __init__(self, left: Any, right: Any) -> None:
        self._left = normalize(_text(left))
        self._right = normalize(_text(right))

    def perform(self, context: LaunchContext) -> str:
        """Compare."""
        return str(_equal(perform(context, self._left), perform(context, self._right))).lower()


def _text(value: Any) -> SomeSubstitutionsType:
    """Return a value as text, unless there are substitutions in it."""
    if is_substitution(value):
        return value
    if value is None:
        return ''
    return str(value).lower() if isinstance(value, bool) else str(value)


def _equal(left: str, right: str) -> bool:
    if left.lower() in TRUTHS and right.lower() in TRUTHS:
        return TRUTHS[left.lower()] == TRUTHS[right.lower()]
    try:
        return math.isclose(float(left), float(right))
    except ValueError:
        return left == right


class IfElseSubstitution(Substitution):
    """One of two texts, by the truth of a third: '1', '0' or a truth of YAML."""

    def __init__(
        self,
        condition: SomeSubstitutionsType,
        if_value: SomeSubstitutionsType = '',
        else_value: SomeSubstitutionsType = '',
    ) -> None:
        if if_value == else_value == '':
            raise RuntimeError('One of if_value and else_value must be specified')
        self._condition = normalize(condition)
        self._values = {True: normalize(if_value), False: normalize(else_value)}

    def perform(self, context: LaunchContext) -> str:
        """Return the text that the condition selects; SubstitutionFailure if it is no truth."""
        return perform(context, self._values[_truth(perform(context, self._condition))])


def _truth(text: str) -> bool:
    try:
        truth = yaml.safe_load({'1': 'true', '0': 'false'}.get(text, text))
    except yaml.YAMLError:
        truth = None
    if not isinstance(truth, bool):
        raise SubstitutionFailure(f"'{text}' is none of 1, 0 and the truths of YAML")
    return truth


class PythonExpression(Substitution):
    """What a Python expression comes to, in which the names of math are known."""

    def __init__(self, expression: SomeSubstitutionsType, python_modules: Any = None) -> None:
        if python_modules is not None:
            refuse_arguments('PythonExpression', {'python_modules': python_modules})
        self._expression = normalize(expression)

    def describe(self) -> str:
        """Describe the expression, and name the modules that it knows."""
        return f"PythonExpr({describe(self._expression)}, ['math'])"

    def perform(self, context: LaunchContext) -> str:
        """Evaluate it."""
        return str(eval(perform(context, self._expression), {}, {**vars(math), 'math': math}))


class Command(Substitution):
    """What a command prints; its line is split as a shell does."""

    def __init__(self, command: SomeSubstitutionsType, **uncovered: Any) -> None:
        refuse_arguments('Command', uncovered)
        self._command = normalize(command)

    def describe(self) -> str:
        """Describe the command."""
        return f'Command({describe(self._command)})'

    def perform(self, context: LaunchContext) -> str:
        """Run it, and return its output; SubstitutionFailure if it fails or writes to stderr."""
        command = perform(context, self._command)
        try:
            result = subprocess.run(shlex.split(command), capture_output=True, text=True)
        except FileNotFoundError as error:
            raise SubstitutionFailure(f'file not found: {error}') from error
        what = 'failed' if result.returncode else 'showed stderr output'
        if result.returncode or result.stderr:
            raise SubstitutionFailure(
                f'executed command {what}. Command: {command}\n'
                f'Captured stderr output: {result.stderr}'
            )
        return result.stdout
