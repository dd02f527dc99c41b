"""Processes that are started, logged and brought to an end."""

import asyncio
from asyncio.subprocess import create_subprocess_exec, DEVNULL
from contextlib import suppress
import os
from signal import SIGINT, SIGKILL, Signals, SIGTERM
import traceback

from .launch_context import LaunchContext
from .line_pipe import LinePipe
from .log import log, OUTPUTS, write

# What follows on which signal, after how many seconds by default.
_ESCALATION = (('sigterm_timeout', SIGINT, SIGTERM), ('sigkill_timeout', SIGTERM, SIGKILL))
_TIMEOUT = '5'


class Process:
    """A process whose output is logged line by line.

    It ends by SIGINT; it gets SIGTERM when it is still there sigterm_timeout seconds later, and
    SIGKILL another sigkill_timeout seconds later: launch configurations, of 5 s by default.
    """

    def __init__(self, name: str, cmd: list[str], output: str) -> None:
        if output not in OUTPUTS:
            raise NotImplementedError(f'output={output!r} is not covered, only {[*OUTPUTS]} are')
        self.name = name
        self.cmd = cmd
        self.pid: int | None = None
        self._destinations = OUTPUTS[output]
        self._escalation: asyncio.Task | None = None

    async def run(self, context: LaunchContext) -> int | None:
        """Run to the end, and return the exit code, or None when it could not be started."""
        get = context.launch_configurations.get
        self._timeouts = [float(get(name, _TIMEOUT)) for name, _, _ in _ESCALATION]
        out, err = (LinePipe(self._writer(where)) for where in self._destinations)
        with out, err:
            try:
                self._process = await create_subprocess_exec(
                    *self.cmd, stdin=DEVNULL, stdout=out.end, stderr=err.end
                )
            except OSError:
                error = traceback.format_exc()
                self._log('ERROR', f'exception occurred while executing process:\n{error}')
                return None
            self.pid = self._process.pid
            self._log('INFO', f'process started with pid [{self.pid}]')
            context.add_process(self)
            returncode = await self._process.wait()
        context.remove_process(self)
        if self._escalation is not None:
            self._escalation.cancel()
        self._log_end(returncode)
        return returncode

    def end(self, send_sigint: bool) -> None:
        """Bring it to an end; without SIGINT when a terminal has sent that already."""
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
        with suppress(ProcessLookupError):  # it ended, which is what was wanted
            # Process.send_signal() may reap the process itself, and asyncio miss the exit code.
            os.kill(self.pid, signal)

    def _writer(self, destinations):
        return lambda line: write(f'[{self.name}] {line}', destinations)

    def _log(self, severity: str, message: str) -> None:
        log(severity, self.name, message)

    def _log_end(self, returncode: int) -> None:
        if returncode == 0:
            self._log('INFO', f'process has finished cleanly [pid {self.pid}]')
            return
        what = f"pid {self.pid}, exit code {returncode}, cmd '{' '.join(self.cmd)}'"
        self._log('ERROR', f'process has died [{what}].')
