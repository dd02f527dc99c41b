"""Processes as actions."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from itertools import count
import os
import re
import shlex
import signal
import traceback
from typing import Any

from ..action import Action
from ..child_process import ChildProcess
from ..conditions import evaluate_condition_expression
from ..event import Event
from ..event_handler import BaseEventHandler, EventHandler
from ..event_handlers import OnProcessExit, OnShutdown
from ..events import Shutdown
from ..events.process import ProcessExited, ProcessStarted, ShutdownProcess, SignalProcess
from ..launch_context import LaunchContext
from ..launch_description_entity import LaunchDescriptionEntity
from ..logging import get_logger, get_output_loggers
from ..substitution import SomeSubstitutionsType
from ..substitutions import LaunchConfiguration
from ..utilities import normalize_to_list_of_substitutions, perform_substitutions
from ..utilities.type_utils import normalize_typed_substitution, perform_typed_substitution
from .simple import OpaqueFunction

_process_numbers = count(1)


class ExecuteProcess(Action):
    """Run a process until it ends or the launch is shut down.

    A shutdown sends SIGINT (a terminal's Ctrl-C has done so already), SIGTERM when the process
    is still there sigterm_timeout seconds later, and SIGKILL another sigkill_timeout seconds
    later.

    Parameters
    ----------
    cmd
        The command and its arguments.
    prefix
        Command line to put before it; by default the launch configuration launch-prefix, for
        executables that launch-prefix-filter matches.
    name
        Name of the process; -1, -2 ... is appended. By default that of the executable.
    cwd
        Directory to run it in.
    env
        Its whole environment; by default that of the launch.
    additional_env
        Environment variables to add.
    shell
        Whether a shell runs the command.
    sigterm_timeout, sigkill_timeout
        Seconds, as text.
    emulate_tty
        Whether the output goes through a pseudo-terminal; the launch configuration
        emulate_tty takes precedence.
    output
        'screen', 'log' (standard error to the screen too) or 'both'.
    log_cmd
        Whether to log the command line.
    on_exit
        What to visit when the process ends, or a function of event and context that returns it.
    respawn
        Whether to start it again when it ends.
    respawn_delay
        Seconds to wait before.
    respawn_max_retries
        How often at most; without a limit when negative.

    """

    def __init__(
        self,
        *,
        cmd: Iterable[SomeSubstitutionsType],
        prefix: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        cwd: SomeSubstitutionsType | None = None,
        env: dict[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        additional_env: dict[SomeSubstitutionsType, SomeSubstitutionsType] | None = None,
        shell: bool = False,
        sigterm_timeout: SomeSubstitutionsType | None = None,
        sigkill_timeout: SomeSubstitutionsType | None = None,
        emulate_tty: bool = False,
        output: SomeSubstitutionsType = 'log',
        log_cmd: bool = False,
        on_exit: Any = None,
        respawn: bool | SomeSubstitutionsType = False,
        respawn_delay: float | None = None,
        respawn_max_retries: int = -1,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self._cmd = [normalize_to_list_of_substitutions(x) for x in cmd]
        self._prefix, self._name, self._cwd = prefix, name, cwd
        self._env, self._additional_env = env, additional_env
        self._shell, self._emulate_tty, self._log_cmd = shell, emulate_tty, log_cmd
        self._timeouts = [
            LaunchConfiguration('sigterm_timeout', default=5)
            if sigterm_timeout is None
            else sigterm_timeout,
            LaunchConfiguration('sigkill_timeout', default=5)
            if sigkill_timeout is None
            else sigkill_timeout,
        ]
        self._output = output
        self._on_exit = on_exit
        self._respawn = normalize_typed_substitution(respawn, bool)
        self._respawn_delay = respawn_delay
        self._respawn_max_retries = respawn_max_retries
        self.process_details: dict[str, Any] | None = None
        self.return_code: int | None = None
        self._process: ChildProcess | None = None
        self._task: asyncio.Task | None = None

    @property
    def name(self) -> str | None:
        """The process's unique name, once it is known."""
        return self.process_details and self.process_details['name']

    @property
    def cmd(self) -> list[Any]:
        """The command line: substitutions first, texts once they are known."""
        return self.process_details['cmd'] if self.process_details else self._cmd

    def get_sub_entities(self) -> list[LaunchDescriptionEntity]:
        """Return what is visited when the process ends, if it is a list."""
        return self._on_exit if isinstance(self._on_exit, list) else []

    def get_asyncio_future(self) -> asyncio.Future | None:
        """Return what is done when the process ended for good."""
        return self._task

    def execute(self, context: LaunchContext) -> None:
        """Start the process, unless the launch is being shut down."""
        if self.process_details is not None:
            raise RuntimeError(f"process '{self.name}' executed more than once: {self.describe()}")
        self._prepare(context)
        if context.is_shutdown:
            return
        for handler in self._event_handlers():
            context.register_event_handler(handler)
        # Its result is whether the process needs a SIGINT from here.
        self._shutdown: asyncio.Future[bool] = context.asyncio_loop.create_future()
        self._task = context.asyncio_loop.create_task(self._run(context))

    def _prepare(self, context: LaunchContext) -> None:
        cmd = self._command(context)
        name = os.path.basename(cmd[0]) if self._name is None else _text(context, self._name)
        env = dict(context.environment) if self._env is None else _texts(context, self._env)
        env.update(_texts(context, self._additional_env or {}))
        self.process_details = {
            'action': self,
            'name': f'{name}-{next(_process_numbers)}',
            'cmd': cmd,
            'cwd': None if self._cwd is None else _text(context, self._cwd),
            'env': env,
        }
        configured = context.launch_configurations.get('emulate_tty')
        if configured is not None:
            expression = normalize_to_list_of_substitutions(configured)
            self._emulate_tty = evaluate_condition_expression(context, expression)
        self._seconds = [float(_text(context, timeout)) for timeout in self._timeouts]
        self._respawn = perform_typed_substitution(context, self._respawn, bool)
        self._logger = get_logger(self.name)
        output = os.environ.get('OVERRIDE_LAUNCH_PROCESS_OUTPUT') or _text(context, self._output)
        self._output_loggers = get_output_loggers(self.name, output)

    def _command(self, context: LaunchContext) -> list[str]:
        """Return the whole command line as text."""
        cmd = [perform_substitutions(context, x) for x in self._cmd]
        prefix = self._prefix
        if prefix is None:
            pattern = context.launch_configurations.get('launch-prefix-filter', '')
            matches = re.match(pattern, os.path.basename(cmd[0]))
            prefix = context.launch_configurations.get('launch-prefix', '') if matches else ''
        return shlex.split(_text(context, prefix)) + cmd

    def _event_handlers(self) -> list[BaseEventHandler]:
        handlers: list[BaseEventHandler] = [
            _targeted(self, ShutdownProcess, lambda event: self._begin_shutdown(True)),
            _targeted(self, SignalProcess, self._on_signal),
            OnShutdown(on_shutdown=self._on_shutdown),
        ]
        if self._on_exit is not None:
            handlers.append(OnProcessExit(target_action=self, on_exit=self._on_exit))
        return handlers

    def _on_shutdown(self, event: Shutdown, context: LaunchContext) -> None:
        self._begin_shutdown(not event.due_to_sigint or context.noninteractive)

    def _begin_shutdown(self, send_sigint: bool) -> None:
        if not self._shutdown.done():
            self._shutdown.set_result(send_sigint)

    def _on_signal(self, event: SignalProcess) -> None:
        if self._process is None:
            raise RuntimeError('Signal event received before the process was started.')
        self._send(signal.Signals[event.signal_name])

    def _send(self, signal_number: signal.Signals) -> None:
        self._logger.info(f"sending signal '{signal_number.name}' to process[{self.name}]")
        with suppress(ProcessLookupError):
            self._process.send_signal(signal_number)

    async def _run(self, context: LaunchContext) -> None:
        retries = 0
        while not self._shutdown.done() and await self._run_once(context):
            if not self._respawn or retries == self._respawn_max_retries:
                return
            retries += 1
            await asyncio.wait({self._shutdown}, timeout=self._respawn_delay or 0.0)

    async def _run_once(self, context: LaunchContext) -> bool:
        """Run the process, and tell if it could be started."""
        try:
            self._process = await self._start()
        except OSError:
            self._logger.error(
                f'exception occurred while executing process:\n{traceback.format_exc()}'
            )
            return False
        details = self.process_details = {**self.process_details, 'pid': self._process.pid}
        self._logger.info(f'process started with pid [{self._process.pid}]')
        context.emit_event_sync(ProcessStarted(**details))
        shutdown = asyncio.create_task(self._shut_down())
        self.return_code = await self._process.wait()
        shutdown.cancel()
        self._log_end()
        context.emit_event_sync(ProcessExited(returncode=self.return_code, **details))
        return True

    async def _start(self) -> ChildProcess:
        details = self.process_details
        cmd, cwd, env = details['cmd'], details['cwd'], details['env']
        if self._log_cmd:
            self._logger.info(f"process details: cmd='{' '.join(cmd)}', cwd='{cwd}'")
        on_stdout, on_stderr = (
            lambda line, log=logger.info: log(f'[{self.name}] {line}')
            for logger in self._output_loggers
        )
        return await ChildProcess.start(
            cmd,
            on_stdout,
            on_stderr,
            cwd=cwd,
            env=env,
            shell=self._shell,
            emulate_tty=self._emulate_tty,
        )

    async def _shut_down(self) -> None:
        """See to the end of the process once it is to end; cancelled when it ended."""
        if await asyncio.shield(self._shutdown):
            self._send(signal.SIGINT)
        waited = 0.0
        for seconds, last, following in zip(
            self._seconds, ['SIGINT', 'SIGTERM'], ['SIGTERM', 'SIGKILL'], strict=True
        ):
            await asyncio.sleep(seconds)
            waited += seconds
            self._logger.error(
                f"process[{self.name}] failed to terminate '{waited:g}' seconds after receiving "
                f"'{last}', escalating to '{following}'"
            )
            self._send(signal.Signals[following])

    def _log_end(self) -> None:
        pid, cmd = self._process.pid, ' '.join(self.process_details['cmd'])
        if self.return_code == 0:
            self._logger.info(f'process has finished cleanly [pid {pid}]')
        else:
            self._logger.error(
                f"process has died [pid {pid}, exit code {self.return_code}, cmd '{cmd}']."
            )


def _text(context: LaunchContext, value: SomeSubstitutionsType) -> str:
    return perform_substitutions(context, normalize_to_list_of_substitutions(value))


def _texts(context: LaunchContext, values: dict) -> dict[str, str]:
    return {_text(context, name): _text(context, value) for name, value in values.items()}


def _targeted(action: ExecuteProcess, event_type: type[Event], react: Any) -> EventHandler:
    def handle(context: LaunchContext) -> None:
        react(context.locals.event)

    return EventHandler(
        matcher=lambda event: isinstance(event, event_type) and event.process_matcher(action),
        entities=OpaqueFunction(function=handle),
    )
