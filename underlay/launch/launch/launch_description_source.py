"""Where a launch description comes from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .launch_context import LaunchContext
from .logging import get_logger
from .substitution import SomeSubstitutionsType
from .utilities import normalize_to_list_of_substitutions, perform_substitutions

if TYPE_CHECKING:
    from .launch_description import LaunchDescription


class LaunchDescriptionSource:
    """A launch description as it is; subclasses load it from their location when needed."""

    def __init__(
        self,
        launch_description: LaunchDescription | None = None,
        location: SomeSubstitutionsType = '<string>',
        method: str = 'unspecified mechanism from a script',
    ) -> None:
        self._launch_description = launch_description
        self._location = normalize_to_list_of_substitutions(location)
        self._expanded_location: str | None = None
        self.method = method

    @property
    def location(self) -> str:
        """The location, described as long as it isn't known."""
        if self._expanded_location is None:
            return ' + '.join(str(sub) for sub in self._location)
        return self._expanded_location

    def try_get_launch_description_without_context(self) -> LaunchDescription | None:
        """Return the launch description, or None where only launching can tell."""
        if self._launch_description is not None:
            return self._launch_description
        try:
            return self._get_launch_description(
                perform_substitutions(LaunchContext(), self._location)
            )
        except Exception as error:  # a launch file may raise anything
            get_logger('launch').debug(f'no launch file without a context: {error}')
            return None

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """Return the launch description, loaded the first time."""
        if self._expanded_location is None:
            self._expanded_location = perform_substitutions(context, self._location)
        if self._launch_description is None:
            self._launch_description = self._get_launch_description(self._expanded_location)
        return self._launch_description

    def _get_launch_description(self, location: str) -> LaunchDescription:
        raise RuntimeError(f'there is no launch description at {location}')
