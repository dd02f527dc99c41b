"""A list of actions, and the launch arguments declared among them."""

from collections.abc import Iterable
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .action import Action
from .actions import DeclareLaunchArgument
from .launch_context import LaunchContext


class LaunchDescription(Partial):
    """Actions that are visited in order."""

    def __init__(self, initial_entities: Iterable[Action] | None = None, **uncovered: Any) -> None:
        refuse_arguments('LaunchDescription', uncovered)
        self.entities = list(initial_entities or [])

    def visit(self, context: LaunchContext) -> list[Action]:
        """Return the actions, to be visited."""
        return self.entities

    def get_launch_arguments(self) -> list[DeclareLaunchArgument]:
        """Return the launch arguments, of several declarations of one the first."""
        arguments: dict[str, DeclareLaunchArgument] = {}
        for entity in self.entities:
            if isinstance(entity, DeclareLaunchArgument):
                arguments.setdefault(entity.name, entity)
        return list(arguments.values())
