"""Actions that are known only while launching."""

from collections.abc import Callable, Iterable
from typing import Any

from ..action import Action
from ..launch_context import LaunchContext


class OpaqueFunction(Action):
    """Call a function with the context, and visit the actions that it returns, if any."""

    def __init__(
        self, *, function: Callable[[LaunchContext], Iterable[Action] | None], **uncovered: Any
    ) -> None:
        super().__init__(**uncovered)
        self._function = function

    def visit(self, context: LaunchContext) -> Iterable[Action] | None:
        """Call the function."""
        return self._function(context)
