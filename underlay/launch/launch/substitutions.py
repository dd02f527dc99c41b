"""Texts that are known only while launching."""

from typing import Any

from underlay_refusal import refuse, refuse_arguments

from .launch_context import LaunchContext
from .substitution import (
    describe,
    normalize,
    perform,
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
)

__all__ = ['LaunchConfiguration', 'SubstitutionFailure', 'TextSubstitution']
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
