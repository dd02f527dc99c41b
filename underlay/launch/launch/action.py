"""What a launch description is made of."""

from collections.abc import Iterable
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .launch_context import LaunchContext


class Action(Partial):
    """Something that is executed when it is visited."""

    def __init__(self, **uncovered: Any) -> None:
        refuse_arguments(type(self).__name__, uncovered)

    def visit(self, context: LaunchContext) -> Iterable['Action'] | None:
        """Execute the action; return what to visit next."""
        return self.execute(context)

    def execute(self, context: LaunchContext) -> Iterable['Action'] | None:
        """Do what the action is for, and return what to visit next."""
        return None
