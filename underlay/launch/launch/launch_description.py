"""A list of actions, and the launch arguments declared among them."""

from collections.abc import Iterable
from typing import Any

from underlay_refusal import refuse_arguments

from .action import Action
from .actions import DeclareLaunchArgument
from .launch_context import LaunchContext


class LaunchDescription:
    """Actions that are visited in order."""

    def __init__(self, initial_entities: Iterable[Action] | None = None, **uncovered: Any) -> None:
        refuse_arguments('LaunchDescription', uncovered)
        self.entities = list(initial_entities or [])

    def visit(self, context: LaunchContext) -> list[Action]:
        """Return the actions, to be visited."""
        return self.entities

    def get_launch_arguments(self) -> list[DeclareLaunchArgument]:
        """Return the launch arguments."""
        return [entity for entity in self.entities if isinstance(entity, DeclareLaunchArgument)]
