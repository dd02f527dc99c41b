"""Launch arguments."""

from __future__ import annotations

from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..logging import get_logger
from ..substitution import SomeSubstitutionsType
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions


class DeclareLaunchArgument(Action):
    """An argument of this launch description, kept in the launch configuration of its name.

    Parameters
    ----------
    name
        Name of the argument.
    default_value
        Its value where none is given; None makes it required.
    description
        Text for those who ask for the arguments.
    choices
        The valid values; None allows any.

    Raises
    ------
    RuntimeError
        When there are choices but none in the list, or the default, if a plain text, isn't one
        of them; and at the visit for a missing value or one that isn't among the choices.

    """

    def __init__(
        self,
        name: str,
        *,
        default_value: SomeSubstitutionsType | None = None,
        description: str | None = None,
        choices: list[str] | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        _check_choices(default_value, choices)
        self.name = name
        self.default_value = (
            None if default_value is None else normalize_to_list_of_substitutions(default_value)
        )
        self.description = _describe(description, choices)
        self.choices = choices
        self._conditionally_included = False  # set where launch arguments are collected

    def execute(self, context: LaunchContext) -> None:
        """Set the launch configuration, unless it is set, and check it."""
        if self.name not in context.launch_configurations:
            context.launch_configurations[self.name] = self._default(context)
        value = context.launch_configurations[self.name]
        if self.choices is not None and value not in self.choices:
            _fail(
                f'Argument "{self.name}" provided value "{value}" is not valid. '
                f'Valid options are: {self.choices}'
            )

    def _default(self, context: LaunchContext) -> str:
        if self.default_value is None:
            get_logger(__name__).error(
                f'Required launch argument "{self.name}" (description: "{self.description}") '
                'was not provided'
            )
            raise RuntimeError(f'Required launch argument "{self.name}" was not provided.')
        return perform_substitutions(context, self.default_value)


def _check_choices(default_value: Any, choices: list[str] | None) -> None:
    if choices is None:
        return
    if not choices:
        _fail('Provided choices arg is empty. Use None to ignore the choice list.')
    if isinstance(default_value, str) and default_value not in choices:
        _fail(f'Provided default_value "{default_value}" is not in provided choices "{choices}".')


def _describe(description: str | None, choices: list[str] | None) -> str:
    if choices is None:
        return 'no description given' if description is None else description
    if description is None:
        return f'One of: {choices}'
    stop = '' if description.endswith('.') else '.'
    return f'{description}{stop} Valid choices are: {choices}'


def _fail(message: str) -> None:
    get_logger(__name__).error(message)
    raise RuntimeError(message)
