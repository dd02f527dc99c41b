"""Several actions, in a scope of their own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..launch_description_entity import LaunchDescriptionEntity
from ..substitution import SomeSubstitutionsType
from .scopes import (
    PopEnvironment,
    PopLaunchConfigurations,
    PushEnvironment,
    PushLaunchConfigurations,
    ResetEnvironment,
    ResetLaunchConfigurations,
    SetLaunchConfiguration,
)


class GroupAction(Action):
    """Actions that share a condition, and a scope for what they set.

    Parameters
    ----------
    actions
        The actions.
    scoped
        Whether launch configurations and environment variables are as before after the group.
    forwarding
        Whether a scoped group sees those from outside.
    launch_configurations
        Launch configurations to set for the group; without forwarding the only ones it has.

    """

    def __init__(
        self,
        actions: Iterable[LaunchDescriptionEntity],
        *,
        scoped: bool = True,
        forwarding: bool = True,
        launch_configurations: dict[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        configurations = launch_configurations or {}
        inner = [*(SetLaunchConfiguration(*x) for x in configurations.items()), *actions]
        if scoped and not forwarding:
            inner = [ResetEnvironment(), ResetLaunchConfigurations(configurations), *actions]
        if scoped:
            inner = [PushLaunchConfigurations(), PushEnvironment(), *inner]
            inner += [PopEnvironment(), PopLaunchConfigurations()]
        self._entities: list[LaunchDescriptionEntity] = inner

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the actions, with those that make the scope."""
        return self._entities

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        """Return the actions, to be visited."""
        return self._entities
