"""The base class of conditions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .launch_context import LaunchContext


class Condition:
    """Whether an action is executed; without a predicate it never is."""

    def __init__(self, *, predicate: Callable[[LaunchContext], bool] | None = None) -> None:
        self._predicate = predicate

    def describe(self) -> str:
        """Describe the condition."""
        return repr(self)

    def evaluate(self, context: LaunchContext) -> bool:
        """Tell if the condition holds in this context."""
        return self._predicate is not None and self._predicate(context)
