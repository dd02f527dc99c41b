"""Launch arguments."""

from typing import Any

from underlay_refusal import refuse_arguments

from ..action import Action
from ..launch_context import LaunchContext
from ..log import log
from ..substitution import normalize, perform, SomeSubstitutionsType


class DeclareLaunchArgument(Action):
    """An argument of this launch description, kept in the launch configuration of its name.

    Without a default value it is required; choices of None allow any value.

    Raises
    ------
    RuntimeError
        When there are no choices, or the default value, if a plain text, isn't one of them; and
        at the visit for a missing value or one that isn't among the choices.

    """

    def __init__(
        self,
        name: str,
        *,
        default_value: SomeSubstitutionsType | None = None,
        description: str | None = None,
        choices: list[str] | None = None,
        **uncovered: Any,
    ) -> None:
        refuse_arguments('DeclareLaunchArgument', uncovered)
        super().__init__()
        if choices is not None and len(choices) == 0:
            _fail('Provided choices arg is empty. Use None to ignore the choice list.')
        if choices is not None and isinstance(default_value, str) and default_value not in choices:
            _fail(f'Provided default_value "{default_value}" is not in provided choices {choices}')
        self.name = name
        self.default_value = None if default_value is None else normalize(default_value)
        self.description = _describe(description, choices)
        self.choices = choices

    def execute(self, context: LaunchContext) -> None:
        """Set the launch configuration, unless it is set, and check it."""
        value = context.launch_configurations.get(self.name)
        if value is None and self.default_value is None:
            _fail(f'Required launch argument "{self.name}" was not provided.')
        if value is None:
            value = perform(context, self.default_value)
        if self.choices is not None and value not in self.choices:
            _fail(
                f'Argument "{self.name}" provided value "{value}" is not valid. '
                f'Valid options are: {self.choices}'
            )
        context.launch_configurations[self.name] = value


def _describe(description: str | None, choices: list[str] | None) -> str:
    if choices is None:
        return 'no description given' if description is None else description
    if description is None:
        return f'One of: {choices}'
    stop = '' if description.endswith('.') else '.'
    return f'{description}{stop} Valid choices are: {choices}'


def _fail(message: str) -> None:
    log('ERROR', __name__, message)
    raise RuntimeError(message)
