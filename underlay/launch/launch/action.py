"""What a launch description is made of."""

from collections.abc import Iterable
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .conditions import IfCondition
from .launch_context import LaunchContext


class Action(Partial):
    """Something that is executed when it is visited, if its condition holds."""

    def __init__(self, *, condition: IfCondition | None = None, **uncovered: Any) -> None:
        refuse_arguments(type(self).__name__, uncovered)
        self.condition = condition

    def visit(self, context: LaunchContext) -> Iterable['Action'] | None:
        """Execute the action if its condition holds; return what to visit next."""
        if self.condition is None or self.condition.evaluate(context):
            return self.execute(context)
        return None

    def execute(self, context: LaunchContext) -> Iterable['Action'] | None:
        """Do what the action is for, and return what to visit next."""
        return None
