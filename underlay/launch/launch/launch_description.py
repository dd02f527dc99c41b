"""A list of actions, and the launch arguments declared among them."""

from collections.abc import Iterable
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .action import Action
from .actions import DeclareLaunchArgument
from .launch_context import LaunchContext


class LaunchDescription(Partial):
    """Actions that are visited in order."""

    def __init__(self, initial_entities: Iterable[Action], **uncovered: Any) -> None:
        refuse_arguments('LaunchDescription', uncovered)
        self.entities = list(initial_entities)

    def visit(self, context: LaunchContext) -> list[Action]:
        """Return the actions to visit."""
        return self.entities

    def get_launch_arguments(self) -> list[DeclareLaunchArgument]:
        """Return the launch arguments."""
        return [each for each in self.entities if isinstance(each, DeclareLaunchArgument)]
