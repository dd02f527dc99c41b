"""Launch arguments."""

from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..log import log


class DeclareLaunchArgument(Action):
    """An argument of a launch description with its default value, both texts.

    Its value is the launch configuration of its name. A visit raises RuntimeError for a value
    that is not among the choices; choices of None allow any value.
    """

    def __init__(
        self,
        name: str,
        *,
        default_value: str,
        description: str,
        choices: list[str] | None = None,
        **uncovered: Any,
    ) -> None:
        super().__init__(**uncovered)
        self.name = name
        self.default_value = default_value
        self.description = _describe(description, choices)
        self.choices = choices

    def visit(self, context: LaunchContext) -> None:
        """Set the launch configuration, unless it is set, and check it."""
        value = context.launch_configurations.setdefault(self.name, self.default_value)
        if self.choices is not None and value not in self.choices:
            message = (
                f'Argument "{self.name}" provided value "{value}" is not valid. '
                f'Valid options are: {self.choices}'
            )
            log('ERROR', __name__, message)
            raise RuntimeError(message)


def _describe(description: str, choices: list[str] | None) -> str:
    if choices is None:
        return description
    stop = '' if description.endswith('.') else '.'
    return f'{description}{stop} Valid choices are: {choices}'
