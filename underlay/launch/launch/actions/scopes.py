"""Launch configurations and environment variables, and the scopes they are set in."""

from __future__ import annotations

from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..substitution import SomeSubstitutionsType
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions


class _Set(Action):
    def __init__(
        self, name: SomeSubstitutionsType, value: SomeSubstitutionsType, **kwargs: Any
    ) -> None:
        super().__init__(**kwargs)
        self.name = normalize_to_list_of_substitutions(name)
        self.value = normalize_to_list_of_substitutions(value)

    def _perform(self, context: LaunchContext) -> dict[str, str]:
        name, value = (perform_substitutions(context, x) for x in (self.name, self.value))
        return {name: value}


class SetLaunchConfiguration(_Set):
    """Set a launch configuration."""

    def execute(self, context: LaunchContext) -> None:
        """Set it."""
        context.launch_configurations.update(self._perform(context))


class SetEnvironmentVariable(_Set):
    """Set an environment variable for the processes that start from here on."""

    def execute(self, context: LaunchContext) -> None:
        """Set it."""
        context.environment.update(self._perform(context))


class PushLaunchConfigurations(Action):
    """Remember the launch configurations."""

    def execute(self, context: LaunchContext) -> None:
        """Remember."""
        context._push_launch_configurations()


class PopLaunchConfigurations(Action):
    """Go back to the launch configurations that were remembered last."""

    def execute(self, context: LaunchContext) -> None:
        """Go back."""
        context._pop_launch_configurations()


class ResetLaunchConfigurations(Action):
    """Forget all launch configurations but the given ones, evaluated before."""

    def __init__(
        self,
        launch_configurations: dict[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self._kept = [SetLaunchConfiguration(*x) for x in (launch_configurations or {}).items()]

    def execute(self, context: LaunchContext) -> None:
        """Forget."""
        kept: dict[str, str] = {}
        for configuration in self._kept:
            kept.update(configuration._perform(context))
        context.launch_configurations.clear()
        context.launch_configurations.update(kept)


class PushEnvironment(Action):
    """Remember the environment variables."""

    def execute(self, context: LaunchContext) -> None:
        """Remember."""
        context._push_environment()


class PopEnvironment(Action):
    """Go back to the environment variables that were remembered last."""

    def execute(self, context: LaunchContext) -> None:
        """Go back."""
        context._pop_environment()


class ResetEnvironment(Action):
    """Go back to the environment variables as they were before launching."""

    def execute(self, context: LaunchContext) -> None:
        """Go back."""
        context._reset_environment()
