"""What the actions of a launch share."""

import asyncio
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .event_types import Shutdown


class LaunchContext(Partial):
    """The state of a launch.

    Attributes
    ----------
    launch_configurations
        Values by name, those of the launch arguments among them.
    event
        The end of the process to which the visited action reacts; None at the start.
    is_shutdown
        Whether all processes are being ended.
    noninteractive
        Whether there is no terminal that sends a Ctrl-C to the processes too.
    tasks
        Tasks that the launch waits for.
    asyncio_loop
        The event loop while the launch runs, otherwise None.

    """

    def __init__(self, *, noninteractive: bool = False, **uncovered: Any) -> None:
        refuse_arguments('LaunchContext', uncovered)
        self.launch_configurations: dict[str, str] = {}
        self.event: Any = None
        self.is_shutdown = False
        self.tasks: set[asyncio.Task] = set()
        self.asyncio_loop: asyncio.AbstractEventLoop | None = None
        self.noninteractive = noninteractive
        self._send_sigint = True
        self._processes: list[Any] = []
        self._event_handlers: list[Any] = []

    def visit(self, entity: Any, event: Any = None) -> None:
        """Visit an action or a launch description, and the ones that it returns."""
        self.event = event
        for following in entity.visit(self) or []:
            self.visit(following, event)

    def register_event_handler(self, event_handler: Any) -> None:
        """Have a handler react to events from now on."""
        self._event_handlers.append(event_handler)

    def emit(self, event: Any) -> None:
        """Let the handlers of an event react, and visit what they return."""
        for handler in [each for each in self._event_handlers if each.matches(event)]:
            if (reaction := handler.react(event, self)) is not None:
                self.visit(reaction, event)

    def add_process(self, process: Any) -> None:
        """Add a process that started, to end it at the shutdown."""
        self._processes.append(process)
        if self.is_shutdown:
            process.end(self._send_sigint)

    def remove_process(self, process: Any) -> None:
        """Remove a process that ended."""
        self._processes.remove(process)

    def shutdown(self, *, due_to_sigint: bool = False) -> None:
        """End all processes, those started last first, and start no more."""
        if self.is_shutdown:
            return
        self.is_shutdown = True
        self._send_sigint = self.noninteractive or not due_to_sigint
        for process in reversed(self._processes):
            process.end(self._send_sigint)
        self.emit(Shutdown())
