"""The event loop of a launch."""

import asyncio
from signal import SIGINT, Signals, SIGQUIT, SIGTERM
import traceback
from typing import Any

from underlay_refusal import Partial, refuse_arguments

from .launch_context import LaunchContext
from .launch_description import LaunchDescription
from .log import log, log_directory


class LaunchService(Partial):
    """Visits launch descriptions, and waits for the processes that they start.

    Parameters
    ----------
    noninteractive
        Whether there is no terminal that sends a Ctrl-C to the processes too.
    debug
        Whether to log the tracebacks of errors.

    """

    def __init__(
        self, *, noninteractive: bool = False, debug: bool = False, **uncovered: Any
    ) -> None:
        refuse_arguments('LaunchService', uncovered)
        self.context = LaunchContext(noninteractive=noninteractive)
        self._debug = debug
        self._descriptions: list[LaunchDescription] = []
        self._return_code = 0

    def include_launch_description(self, launch_description: LaunchDescription) -> None:
        """Visit a launch description at the start of the run."""
        self._descriptions.append(launch_description)

    def run(self) -> int:
        """Run in the main thread until all processes ended.

        Return 0, or 1 after an error of the launch. A failing process is not such an error.
        """
        try:
            return asyncio.run(self._run())
        finally:
            self.context.asyncio_loop = None

    async def _run(self) -> int:
        loop = self.context.asyncio_loop = asyncio.get_running_loop()
        loop.add_signal_handler(SIGINT, self._on_sigint)
        for signal in (SIGTERM, SIGQUIT):
            loop.add_signal_handler(signal, self._on_sigterm, signal)
        log('INFO', 'launch', f'All log files can be found below {log_directory()}')
        level = 'DEBUG' if self._debug else 'INFO'
        log('INFO', 'launch', f'Default logging verbosity is set to {level}')
        try:
            for description in self._descriptions:
                self.context.visit(description)
        except Exception as error:  # any error of an action ends the launch in order
            self._on_error(error)
        while self.context.tasks:
            await self._wait()
        return self._return_code

    async def _wait(self) -> None:
        """Wait for any of the tasks, and handle its error."""
        done, _ = await asyncio.wait(self.context.tasks, return_when=asyncio.FIRST_COMPLETED)
        self.context.tasks -= done
        for task in done:
            if error := task.exception():
                self._on_error(error)

    def _on_error(self, error: BaseException) -> None:
        if self._debug:
            log('DEBUG', 'launch', ''.join(traceback.format_exception(error)))
        message = f'Caught exception in launch (see debug for traceback): {error}'
        log('ERROR', 'launch', message)
        self._return_code = 1
        self.context.shutdown()

    def _on_sigint(self) -> None:
        again = ' again, ignoring...' if self.context.is_shutdown else ''
        log('WARNING', 'launch', f'user interrupted with ctrl-c (SIGINT){again}')
        self.context.shutdown(due_to_sigint=True)

    def _on_sigterm(self, signal: Signals) -> None:
        """End as on a shutdown, with exit code 1."""
        log('ERROR', 'launch', f'user interrupted ({signal.name}), terminating...')
        self._return_code = 1
        self.context.shutdown()
