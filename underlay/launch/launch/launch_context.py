"""What the actions of a launch share."""

import asyncio
from types import SimpleNamespace
from typing import Any

from underlay_refusal import Partial, refuse_arguments


class LaunchContext(Partial):
    """The state of a launch.

    Attributes
    ----------
    launch_configurations
        Values by name, those of the launch arguments among them.
    locals
        Has the event that is reacted to, if any, as its attribute event.
    is_shutdown
        Whether all that was launched is to end.
    noninteractive
        Whether there is no terminal that sends a Ctrl-C to the processes too.
    tasks
        Work that the launch waits for.

    """

    def __init__(self, *, noninteractive: bool = False, **uncovered: Any) -> None:
        refuse_arguments('LaunchContext', uncovered)
        self.launch_configurations: dict[str, str] = {}
        self.locals = SimpleNamespace()
        self.is_shutdown = False
        self.tasks: set[asyncio.Task] = set()
        self.noninteractive = noninteractive
        self._send_sigint = True
        self._processes: list[Any] = []

    def visit(self, entity: Any) -> None:
        """Visit an action or a launch description, and what it says to visit next."""
        for following in entity.visit(self) or []:
            self.visit(following)

    def add_process(self, process: Any) -> None:
        """Take in a process that started, to be ended at the shutdown."""
        self._processes.append(process)
        if self.is_shutdown:
            process.end(self._send_sigint)

    def remove_process(self, process: Any) -> None:
        """Forget a process that ended."""
        self._processes.remove(process)

    def shutdown(self, *, due_to_sigint: bool = False) -> None:
        """End all processes, those started last first, and start no more."""
        if self.is_shutdown:
            return
        self.is_shutdown = True
        self._send_sigint = self.noninteractive or not due_to_sigint
        for process in reversed(self._processes):
            process.end(self._send_sigint)
