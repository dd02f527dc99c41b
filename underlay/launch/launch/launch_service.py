"""The event loop of a launch."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import logging
import signal
import threading
import traceback

from .event import Event
from .event_handler import entities_list
from .events import IncludeLaunchDescription, Shutdown
from .launch_context import LaunchContext
from .launch_description import LaunchDescription
from .launch_description_entity import LaunchDescriptionEntity
from .logging import get_logger, log_directory, set_level


class LaunchService:
    """Visits launch descriptions and handles events until all work is done.

    Parameters
    ----------
    argv
        Command line, for the entities that want to see it.
    noninteractive
        Whether there is no terminal that sends a Ctrl-C to the children too.
    debug
        Whether to log in detail.

    """

    def __init__(
        self,
        *,
        argv: Iterable[str] | None = None,
        noninteractive: bool = False,
        debug: bool = False,
    ) -> None:
        set_level(logging.DEBUG if debug else logging.INFO)
        self._logger = get_logger('launch')
        self.context = LaunchContext(argv=argv, noninteractive=noninteractive)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._futures: list[asyncio.Future] = []
        self._return_code = 0

    def include_launch_description(self, launch_description: LaunchDescription) -> None:
        """Visit a launch description, at the start of the run or in it."""
        self.emit_event(IncludeLaunchDescription(launch_description))

    def emit_event(self, event: Event) -> None:
        """Queue an event; from any thread."""
        if self._loop is None:
            self.context.emit_event_sync(event)
        else:
            self._loop.call_soon_threadsafe(self.context.emit_event_sync, event)

    def shutdown(self) -> None:
        """End all that was launched, and then the run; from any thread."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._shutdown, 'LaunchService.shutdown() called')

    def run(self, *, shutdown_when_idle: bool = True) -> int:
        """Run until all work is done, and return 0, or 1 when there was an error.

        Processes that fail are no such error.
        """
        return asyncio.run(self.run_async(shutdown_when_idle=shutdown_when_idle))

    async def run_async(self, *, shutdown_when_idle: bool = True) -> int:
        """Do as :meth:`run` in an event loop that runs already, of the main thread."""
        if threading.current_thread() is not threading.main_thread():
            raise RuntimeError('LaunchService can only be run in the main thread.')
        if self._loop is not None:
            raise RuntimeError('LaunchService cannot be run multiple times concurrently.')
        self._return_code = 0
        with self._running():
            self._logger.info(f'All log files can be found below {log_directory()}')
            level = logging.getLevelName(self._logger.getEffectiveLevel())
            self._logger.info(f'Default logging verbosity is set to {level}')
            while await self._step(shutdown_when_idle):
                pass
        return self._return_code

    @contextmanager
    def _running(self) -> Iterator[None]:
        loop = self._loop = self.context.asyncio_loop = asyncio.get_running_loop()
        self.context._event_emitted = asyncio.Event()
        self.context.is_shutdown = False
        loop.add_signal_handler(signal.SIGINT, self._on_sigint)
        for signal_number in (signal.SIGTERM, signal.SIGQUIT):
            loop.add_signal_handler(signal_number, self._on_sigterm, signal_number)
        try:
            yield
        finally:
            for signal_number in (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT):
                loop.remove_signal_handler(signal_number)
            self._loop = self.context.asyncio_loop = self.context._event_emitted = None

    def _on_sigint(self) -> None:
        message = 'user interrupted with ctrl-c (SIGINT)'
        if self.context.is_shutdown:
            self._logger.warning(f'{message} again, ignoring...')
        else:
            self._logger.warning(message)
            self._shutdown('ctrl-c (SIGINT)', due_to_sigint=True)

    def _on_sigterm(self, signal_number: signal.Signals) -> None:
        """End as on a shutdown, and say that it was no regular end."""
        self._logger.error(f'user interrupted ({signal_number.name}), terminating...')
        self._return_code = 1
        self._shutdown(signal_number.name)

    def _shutdown(self, reason: str, due_to_sigint: bool = False) -> None:
        if not self.context.is_shutdown:
            self.context.is_shutdown = True
            self.context.emit_event_sync(Shutdown(reason=reason, due_to_sigint=due_to_sigint))

    async def _step(self, shutdown_when_idle: bool) -> bool:
        """Handle an event or wait for one, and tell if there is more to do."""
        try:
            if self.context._events:
                self._process_event(self.context._events.popleft())
                await asyncio.sleep(0)  # let I/O go on between events
                return True
            self._collect_done()
        except Exception as error:  # whatever an entity raises ends the launch in order
            self._on_error(error)
            return True
        if not self._futures:
            if self.context.is_shutdown:
                return bool(self.context._events)
            if shutdown_when_idle:
                self._shutdown('idle')
                return True
        await self._wait()
        return True

    def _on_error(self, error: Exception) -> None:
        message = f'Caught exception in launch (see debug for traceback): {error}'
        self._logger.debug(traceback.format_exc())
        self._logger.error(message)
        self._return_code = 1
        self._shutdown(message)

    def _collect_done(self) -> None:
        """Forget the work that is done, and raise the error of one that failed."""
        self._futures += self.context._completion_futures
        self.context._completion_futures = []
        done = [future for future in self._futures if future.done()]
        self._futures = [future for future in self._futures if not future.done()]
        for future in done:
            if not future.cancelled():
                future.result()

    async def _wait(self) -> None:
        self.context._event_emitted.clear()
        emitted = asyncio.ensure_future(self.context._event_emitted.wait())
        await asyncio.wait([emitted, *self._futures], return_when=asyncio.FIRST_COMPLETED)
        emitted.cancel()

    def _process_event(self, event: Event) -> None:
        self._logger.debug(f"processing event: '{event.name}'")
        if isinstance(event, Shutdown):
            self.context.is_shutdown = True
        if isinstance(event, IncludeLaunchDescription):
            with self.context._scoped_locals():
                self._visit(event.launch_description)
        for handler in tuple(self.context._event_handlers):
            if handler.matches(event):
                with self.context._scoped_locals():
                    for entity in entities_list(handler.handle(event, self.context)):
                        self._visit(entity)

    def _visit(self, entity: LaunchDescriptionEntity) -> None:
        sub_entities = entity.visit(self.context)
        future = entity.get_asyncio_future()
        if future is not None and future not in self._futures:
            self._futures.append(future)
        for sub_entity in sub_entities or []:
            self._visit(sub_entity)
