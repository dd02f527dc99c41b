"""Processes that are started, shown and ended."""

import asyncio
from asyncio.subprocess import create_subprocess_exec, DEVNULL
from collections.abc import Callable
from contextlib import suppress
import os
from signal import SIGINT, SIGKILL, Signals, SIGTERM

from .launch_context import LaunchContext
from .line_pipe import LinePipe
from .log import log, show

# Launch configurations that set the seconds from one signal to the next, and their default.
_ESCALATION = (('sigterm_timeout', SIGINT, SIGTERM), ('sigkill_timeout', SIGTERM, SIGKILL))
_TIMEOUT = '5'


class Process:
    """A process whose output is shown line by line.

    It is ended by SIGINT. If it still runs sigterm_timeout seconds later, SIGTERM follows, and
    SIGKILL another sigkill_timeout seconds later: launch configurations, of 5 s by default, or as
    given.
    """

    def __init__(self, name: str, cmd: list[str], **timeouts: str) -> None:
        self.name = name
        self.cmd = cmd
        self._given = timeouts
        self.pid: int | None = None
        self._escalation: asyncio.Task | None = None

    async def run(self, context: LaunchContext, on_start: Callable[[], None]) -> int:
        """Run to the end; return the exit code. Raises OSError if it cannot be started."""
        seconds = context.launch_configurations | self._given
        self._timeouts = [float(seconds.get(name, _TIMEOUT)) for name, _, _ in _ESCALATION]
        with LinePipe(self._show) as out, LinePipe(self._show) as err:
            process = await create_subprocess_exec(
                *self.cmd, stdin=DEVNULL, stdout=out.end, stderr=err.end
            )
            self.pid = process.pid
            self._log('INFO', f'process started with pid [{self.pid}]')
            context.add_process(self)
            on_start()
            returncode = await process.wait()
        context.remove_process(self)
        if self._escalation is not None:
            self._escalation.cancel()
        self._log_end(returncode)
        return returncode

    def end(self, send_sigint: bool) -> None:
        """End it, without SIGINT if a terminal has sent that already."""
        if send_sigint:
            self._send(SIGINT)
        self._escalation = asyncio.create_task(self._escalate())

    async def _escalate(self) -> None:
        waited = 0.0
        for seconds, (_, last, following) in zip(self._timeouts, _ESCALATION, strict=True):
            await asyncio.sleep(seconds)
            waited += seconds
            self._log(
                'ERROR',
                f"process[{self.name}] failed to terminate '{waited:g}' seconds after receiving "
                f"'{last.name}', escalating to '{following.name}'",
            )
            self._send(following)

    def _send(self, signal: Signals) -> None:
        self._log('INFO', f"sending signal '{signal.name}' to process[{self.name}]")
        with suppress(ProcessLookupError):  # it has ended already
            # Process.send_signal() may reap the process itself, and asyncio miss the exit code.
            os.kill(self.pid, signal)

    def _show(self, line: str) -> None:
        show(f'[{self.name}] {line}')

    def _log(self, severity: str, message: str) -> None:
        log(severity, self.name, message)

    def _log_end(self, returncode: int) -> None:
        if returncode == 0:
            self._log('INFO', f'process has finished cleanly [pid {self.pid}]')
            return
        what = f"pid {self.pid}, exit code {returncode}, cmd '{' '.join(self.cmd)}'"
        self._log('ERROR', f'process has died [{what}].')
