"""Text that is known only while launching."""

from __future__ import annotations

from collections.abc import Iterable

from underlay_refusal import Partial

from .launch_context import LaunchContext


class Substitution(Partial):
    """Text that is known only while launching."""

    def describe(self) -> str:
        """Describe the substitution without performing it."""
        return repr(self)

    def perform(self, context: LaunchContext) -> str:
        """Return the text in this context."""
        raise NotImplementedError(f'{type(self).__name__} has no perform()')


SomeSubstitutionsType = str | Substitution | Iterable[str | Substitution]


class TextSubstitution(Substitution):
    """Text as it is."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f'expected text or a substitution, got {text!r}')
        self.text = text

    def describe(self) -> str:
        """Return the text in quotes."""
        return f"'{self.text}'"

    def perform(self, context: LaunchContext) -> str:
        """Return the text."""
        return self.text


def is_substitution(value: object) -> bool:
    """Tell if a value is a substitution, or a list or tuple with one in it."""
    parts = value if isinstance(value, (list, tuple)) else [value]
    return any(isinstance(part, Substitution) for part in parts)


def normalize(value: SomeSubstitutionsType) -> list[Substitution]:
    """Return a list of substitutions from a text, a substitution or several of them.

    Anything else, a path for instance, is a TypeError.
    """
    items = [value] if isinstance(value, (str, Substitution)) else value
    return [x if isinstance(x, Substitution) else TextSubstitution(text=x) for x in items]


def perform(context: LaunchContext, substitutions: Iterable[Substitution]) -> str:
    """Return the texts of the substitutions as one."""
    return ''.join(substitution.perform(context) for substitution in substitutions)


def describe(substitutions: Iterable[Substitution]) -> str:
    """Describe substitutions that follow each other."""
    return ' + '.join(substitution.describe() for substitution in substitutions)
