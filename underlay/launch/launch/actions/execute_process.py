"""Processes as actions."""

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import count
import os
import shlex
from types import SimpleNamespace
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from ..action import Action
from ..launch_context import LaunchContext
from ..log import OUTPUTS
from ..process import Process
from ..substitution import normalize, perform, SomeSubstitutionsType

_numbers = count(1)
# What else launch configurations set in processes.
_UNCOVERED = ('emulate_tty', 'launch-prefix', 'launch-prefix-filter')


@dataclass(frozen=True)
class ProcessExited(Partial):
    """The end of a process; a negative returncode is the signal that ended it."""

    process_name: str
    cmd: list[str]
    pid: int
    returncode: int


Reaction = Action | Iterable[Action] | None


class ExecuteProcess(Action):
    """Run a process until it ends or the launch is shut down.

    Parameters
    ----------
    cmd
        The command and its arguments.
    prefix
        Words that come first, as a shell splits them.
    name
        Name of the process, by default that of the first word; -1, -2 ... is appended.
    output
        'screen', 'log' (standard error to the screen too) or 'both'; the environment's
        OVERRIDE_LAUNCH_PROCESS_OUTPUT goes before it.
    on_exit
        What to visit when the process ended, or a function of event and context that returns it.

    """

    def __init__(
        self,
        *,
        cmd: Iterable[SomeSubstitutionsType],
        prefix: SomeSubstitutionsType = '',
        name: SomeSubstitutionsType | None = None,
        output: SomeSubstitutionsType = 'log',
        on_exit: Reaction | Callable[[ProcessExited, LaunchContext], Reaction] = None,
        **options: Any,
    ) -> None:
        super().__init__(**options)
        if isinstance(output, Mapping):
            raise NotImplementedError(f'output={output!r} is not covered, only {[*OUTPUTS]} are')
        self._cmd = [normalize(word) for word in cmd]
        self._prefix = normalize(prefix)
        self._name = None if name is None else normalize(name)
        self._output = normalize(os.environ.get('OVERRIDE_LAUNCH_PROCESS_OUTPUT', output))
        self._on_exit = on_exit
        self._is_executed = False

    def command(self, context: LaunchContext) -> list[str]:
        """Return the command line as text."""
        prefix = shlex.split(perform(context, self._prefix))
        return prefix + [perform(context, word) for word in self._cmd]

    def execute(self, context: LaunchContext) -> None:
        """Start the process, unless the launch is being shut down; RuntimeError if it was."""
        configurations = context.launch_configurations
        refuse_arguments('ExecuteProcess', {k: 1 for k in _UNCOVERED if k in configurations})
        cmd = self.command(context)
        name = os.path.basename(cmd[0]) if self._name is None else perform(context, self._name)
        process = Process(f'{name}-{next(_numbers)}', cmd, perform(context, self._output))
        if self._is_executed:
            raise RuntimeError(f"ExecuteProcess action '{process.name}': executed more than once")
        self._is_executed = True
        context.tasks.add(asyncio.create_task(self._run(process, context)))

    async def _run(self, process: Process, context: LaunchContext) -> None:
        if context.is_shutdown:
            return
        returncode = await process.run(context)
        if returncode is not None:
            self._react(ProcessExited(process.name, process.cmd, process.pid, returncode), context)

    def _react(self, event: ProcessExited, context: LaunchContext) -> None:
        context.locals = SimpleNamespace(event=event)
        try:
            react = self._on_exit
            reaction = react(event, context) if callable(react) else react
            for action in [reaction] if isinstance(reaction, Action) else reaction or []:
                context.visit(action)
        finally:
            context.locals = SimpleNamespace()
