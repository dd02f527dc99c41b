"""Text, launch configurations, and paths made of them."""

from __future__ import annotations

from collections.abc import Iterable
import os
from typing import Any, TYPE_CHECKING

from ..frontend import expose_substitution
from ..substitution import SomeSubstitutionsType, Substitution
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions
from .substitution_failure import SubstitutionFailure

if TYPE_CHECKING:
    from ..launch_context import LaunchContext


def describe_all(subs: Iterable[Substitution]) -> str:
    """Describe substitutions that follow each other."""
    return ' + '.join(sub.describe() for sub in subs)


class TextSubstitution(Substitution):
    """Text as it is."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f'TextSubstitution expected a text, got a {type(text)}')
        self.text = text

    def describe(self) -> str:
        """Return the text in quotes."""
        return f"'{self.text}'"

    def perform(self, context: LaunchContext) -> str:
        """Return the text."""
        return self.text


@expose_substitution('var')
class LaunchConfiguration(Substitution):
    """The value of a launch configuration, which launch arguments are too."""

    def __init__(self, variable_name: SomeSubstitutionsType, *, default: Any = None) -> None:
        self.variable_name = normalize_to_list_of_substitutions(variable_name)
        self._default = None if default is None else _to_substitutions(default)

    def describe(self) -> str:
        """Name the configuration."""
        return f'LaunchConfig({describe_all(self.variable_name)})'

    def perform(self, context: LaunchContext) -> str:
        """Return the configuration, or the default where it isn't set."""
        name = perform_substitutions(context, self.variable_name)
        if name in context.launch_configurations:
            return context.launch_configurations[name]
        if self._default is None:
            raise SubstitutionFailure(f"launch configuration '{name}' does not exist")
        return perform_substitutions(context, self._default)


def _to_substitutions(value: Any) -> list[Substitution]:
    items = value if isinstance(value, Iterable) and not isinstance(value, str) else [value]
    return normalize_to_list_of_substitutions(
        [item if isinstance(item, (str, Substitution)) else str(item) for item in items]
    )


class PathJoinSubstitution(Substitution):
    """A path of several parts."""

    def __init__(self, substitutions: Iterable[str | Substitution]) -> None:
        self.substitutions = normalize_to_list_of_substitutions(substitutions)

    def describe(self) -> str:
        """Describe the parts."""
        return f"PathJoin('{describe_all(self.substitutions)}')"

    def perform(self, context: LaunchContext) -> str:
        """Return the joined path."""
        return os.path.join(*(sub.perform(context) for sub in self.substitutions))
