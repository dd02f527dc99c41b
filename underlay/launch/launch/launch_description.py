"""A list of entities to visit, and the launch arguments declared among them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TYPE_CHECKING

from .launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from .action import Action
    from .actions import DeclareLaunchArgument, IncludeLaunchDescription
    from .launch_context import LaunchContext

    Declarations = list[tuple[DeclareLaunchArgument, tuple[IncludeLaunchDescription, ...]]]


class LaunchDescription(LaunchDescriptionEntity):
    """Entities that are visited in order."""

    def __init__(
        self, initial_entities: Iterable[LaunchDescriptionEntity] | None = None, **uncovered: Any
    ) -> None:
        if uncovered:
            raise NotImplementedError(f'LaunchDescription({", ".join(uncovered)}=) is not covered')
        self.entities = list(initial_entities or [])

    def visit(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        """Return the entities, to be visited."""
        return self.entities

    def describe_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the entities."""
        return self.entities

    def add_entity(self, entity: LaunchDescriptionEntity) -> None:
        """Append an entity."""
        self.entities.append(entity)

    def add_action(self, action: Action) -> None:
        """Append an action."""
        self.add_entity(action)

    def get_launch_arguments(
        self, conditional_inclusion: bool = False
    ) -> list[DeclareLaunchArgument]:
        """Return the launch arguments that can be seen without launching, the first of a name."""
        return [
            argument
            for argument, _ in self.get_launch_arguments_with_include_launch_description_actions(
                conditional_inclusion
            )
        ]

    def get_launch_arguments_with_include_launch_description_actions(
        self, conditional_inclusion: bool = False
    ) -> Declarations:
        """Return the launch arguments, each with the inclusions that lead to it."""
        declarations: Declarations = []
        _collect(self.entities, conditional_inclusion, (), declarations)
        return declarations


def _collect(
    entities: Iterable[LaunchDescriptionEntity],
    conditional: bool,
    inclusions: tuple[IncludeLaunchDescription, ...],
    found: Declarations,
) -> None:
    from .actions import (
        DeclareLaunchArgument,
        IncludeLaunchDescription,
        ResetLaunchConfigurations,
    )

    for entity in entities:
        if isinstance(entity, ResetLaunchConfigurations):
            return  # what is declared from here on can't be set from outside
        seen = {argument.name for argument, _ in found}
        if isinstance(entity, DeclareLaunchArgument) and entity.name not in seen:
            entity._conditionally_included = conditional or entity.condition is not None
            found.append((entity, inclusions))
        is_inclusion = isinstance(entity, IncludeLaunchDescription)
        path = (*inclusions, entity) if is_inclusion else inclusions
        _collect(entity.describe_sub_entities(), False, path, found)
        for _, conditional_entities in entity.describe_conditional_sub_entities():
            _collect(conditional_entities, True, path, found)
