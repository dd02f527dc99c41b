"""The end of a launch."""

from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..log import log


class Shutdown(Action):
    """End all processes."""

    def __init__(self, *, reason: str = 'reason not given', **uncovered: Any) -> None:
        super().__init__(**uncovered)
        self.reason = reason

    def visit(self, context: LaunchContext) -> None:
        """Begin the shutdown, and log the process whose end led to it."""
        if context.event is not None:
            required = f'process[{context.event.process_name}] was required'
            log('INFO', 'launch', f'{required}: shutting down launched system')
        context.shutdown()
