"""The base class of what a launch description does."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TYPE_CHECKING

from .launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from .condition import Condition
    from .launch_context import LaunchContext


class Action(LaunchDescriptionEntity):
    """An entity that is executed when visited, if its condition holds.

    Parameters
    ----------
    condition
        Evaluated at the visit; None holds always.

    Raises
    ------
    NotImplementedError
        For an argument that the underlay's version of the action does not cover.

    """

    def __init__(self, *, condition: Condition | None = None, **uncovered: Any) -> None:
        if uncovered:
            names = ', '.join(sorted(uncovered))
            raise NotImplementedError(f'{type(self).__name__}({names}=) is not covered')
        self.condition = condition

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the entities that this action brings along, as far as is known."""
        return []

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the sub-entities of an action without a condition."""
        return self.get_sub_entities() if self.condition is None else []

    def describe_conditional_sub_entities(
        self,
    ) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        """Return the sub-entities of an action with a condition."""
        if self.condition is None:
            return []
        return [(f'Conditionally included by {self.describe()}', self.get_sub_entities())]

    def visit(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Execute the action if its condition holds."""
        if self.condition is None or self.condition.evaluate(context):
            return self.execute(context)
        return None

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity] | None:
        """Do what the action is for, and return the entities to visit next."""
        return None
