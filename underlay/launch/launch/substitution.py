"""Text that is known only while launching."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .launch_context import LaunchContext


class Substitution:
    """Text that is known only while launching."""

    def describe(self) -> str:
        """Describe the substitution without performing it."""
        return repr(self)

    def perform(self, context: LaunchContext) -> str:
        """Return the text in this context."""
        raise NotImplementedError(f'{type(self).__name__} has no perform()')


SomeSubstitutionsType = str | Substitution | Iterable[str | Substitution]
