"""Launch descriptions in others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..launch_description import LaunchDescription
from ..launch_description_entity import LaunchDescriptionEntity
from ..launch_description_source import LaunchDescriptionSource
from ..launch_description_sources import AnyLaunchDescriptionSource
from ..substitution import SomeSubstitutionsType
from ..substitutions import SubstitutionFailure
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions
from .scopes import SetLaunchConfiguration


class IncludeLaunchDescription(Action):
    """Visit another launch description; it shares the scope of this one.

    Parameters
    ----------
    launch_description_source
        Where the launch description comes from; a text is the path of a launch file.
    launch_arguments
        Pairs of name and value, for the arguments that it declares or otherwise wants.

    """

    def __init__(
        self,
        launch_description_source: LaunchDescriptionSource | SomeSubstitutionsType,
        *,
        launch_arguments: Iterable[tuple[SomeSubstitutionsType, SomeSubstitutionsType]]
        | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        if not isinstance(launch_description_source, LaunchDescriptionSource):
            launch_description_source = AnyLaunchDescriptionSource(launch_description_source)
        self.launch_description_source = launch_description_source
        self.launch_arguments = tuple(launch_arguments or ())

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return the launch description, if it can be had without launching."""
        description = self.launch_description_source.try_get_launch_description_without_context()
        return [] if description is None else [description]

    def execute(self, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        """Check that required arguments are given, set them, and visit the launch description.

        Raises
        ------
        RuntimeError
            When an argument is required and not given.

        """
        description = self.launch_description_source.get_launch_description(context)
        self._check_required(description, context)
        return [*(SetLaunchConfiguration(*x) for x in self.launch_arguments), description]

    def _check_required(self, description: LaunchDescription, context: LaunchContext) -> None:
        collect = description.get_launch_arguments_with_include_launch_description_actions
        given = self._argument_names(context)
        for argument, inclusions in collect():
            if argument._conditionally_included or argument.default_value is not None:
                continue
            names = given + [n for i in inclusions for n in i._argument_names(LaunchContext())]
            if argument.name not in names:
                raise RuntimeError(
                    f"Included launch description missing required argument '{argument.name}' "
                    f"(description: '{argument.description}'), given: [{', '.join(names)}]"
                )

    def _argument_names(self, context: LaunchContext) -> list[str]:
        """Return the names that are known; a name may need a context that isn't there yet."""
        names = []
        for name, _ in self.launch_arguments:
            try:
                names.append(
                    perform_substitutions(context, normalize_to_list_of_substitutions(name))
                )
            except SubstitutionFailure:
                continue
        return names
