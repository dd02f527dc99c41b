"""The end of a launch."""

from typing import Any

from ..action import Action
from ..launch_context import LaunchContext
from ..log import log


class Shutdown(Action):
    """End all that was launched."""

    def __init__(self, *, reason: str = 'reason not given', **options: Any) -> None:
        super().__init__(**options)
        self.reason = reason

    def execute(self, context: LaunchContext) -> None:
        """Begin the shutdown, and say so when it is for a process that ended."""
        event = getattr(context.locals, 'event', None)
        if event is not None:
            required = f'process[{event.process_name}] was required'
            log('INFO', 'launch', f'{required}: shutting down launched system')
        context.shutdown()
