"""Processes as actions."""

import asyncio
from collections.abc import Callable
from itertools import count
import os
import shlex
from typing import Any

from underlay_refusal import refuse_arguments

from ..action import Action
from ..event_types import ProcessExited, ProcessStarted
from ..launch_context import LaunchContext
from ..process import Process

_numbers = count(1)
# Launch configurations that change processes.
_UNCOVERED = ('emulate_tty', 'launch-prefix', 'launch-prefix-filter')


class ExecuteProcess(Action):
    """Run a process until it ends or the launch is shut down.

    Parameters
    ----------
    cmd
        The command and its arguments.
    output
        'screen': a line at a time, after the name of the process.
    prefix
        Words that come first, as a shell splits them.
    name
        Name of the process, by default that of the first word; -1, -2 ... is appended.
    on_exit
        Function of event and context, called when the process ended. It returns an action to
        visit, or None.
    sigterm_timeout, sigkill_timeout
        Time until it gets SIGTERM, and from then to SIGKILL [s], by default those of the launch.

    """

    def __init__(
        self,
        *,
        cmd: list[str],
        output: str = 'log',
        prefix: str = '',
        name: str | None = None,
        on_exit: Callable[[ProcessExited, LaunchContext], Action | None] = lambda *_: None,
        sigterm_timeout: str | None = None,
        sigkill_timeout: str | None = None,
        **uncovered: Any,
    ) -> None:
        super().__init__(**uncovered)
        if output != 'screen':
            raise NotImplementedError(f"output={output!r} is not covered, only 'screen' is")
        self._cmd = cmd
        self._prefix = prefix
        self._name = name
        self._on_exit = on_exit
        own = {'sigterm_timeout': sigterm_timeout, 'sigkill_timeout': sigkill_timeout}
        self._timeouts = {name: value for name, value in own.items() if value is not None}

    def command(self, context: LaunchContext) -> list[str]:
        """Return the command line without the prefix."""
        return self._cmd

    def visit(self, context: LaunchContext) -> None:
        """Start the process, unless the launch is being shut down."""
        configurations = context.launch_configurations
        refuse_arguments('ExecuteProcess', {k: 1 for k in _UNCOVERED if k in configurations})
        cmd = shlex.split(self._prefix) + self.command(context)
        name = f'{self._name or os.path.basename(cmd[0])}-{next(_numbers)}'
        process = Process(name, cmd, **self._timeouts)
        context.tasks.add(asyncio.create_task(self._run(process, context)))

    async def _run(self, process: Process, context: LaunchContext) -> None:
        if context.is_shutdown:
            return

        def started() -> None:
            context.emit(ProcessStarted(self, process.name, process.cmd, process.pid))

        returncode = await process.run(context, started)
        event = ProcessExited(process.name, process.cmd, process.pid, returncode)
        reaction = self._on_exit(event, context)
        if reaction is not None:
            context.visit(reaction, event)
