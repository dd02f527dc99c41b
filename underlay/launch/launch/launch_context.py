"""What entities share while a launch runs."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable, Iterator, MutableMapping
from contextlib import contextmanager
import os
from types import SimpleNamespace
from typing import Any, TYPE_CHECKING

from .event import Event
from .substitution import Substitution

if TYPE_CHECKING:
    from .event_handler import BaseEventHandler


class LaunchContext:
    """Launch configurations, environment, locals, events and their handlers.

    Parameters
    ----------
    argv
        Command line, for the entities that want to see it.
    noninteractive
        Whether there is no terminal that sends a Ctrl-C to the children too.

    """

    def __init__(self, *, argv: Iterable[str] | None = None, noninteractive: bool = False) -> None:
        self.argv = list(argv or [])
        self.noninteractive = noninteractive
        self.is_shutdown = False
        self.asyncio_loop: asyncio.AbstractEventLoop | None = None
        self.launch_configurations: dict[str, Any] = {}
        self._configurations_stack: list[dict[str, Any]] = []
        self._environment_stack: list[dict[str, str]] = []
        self._first_environment = dict(os.environ)
        self._globals: dict[str, Any] = {}
        self._locals: dict[str, Any] = {}
        self._event_handlers: deque[BaseEventHandler] = deque()
        self._events: deque[Event] = deque()
        self._event_emitted: asyncio.Event | None = None
        self._completion_futures: list[asyncio.Future] = []

    @property
    def environment(self) -> MutableMapping[str, str]:
        """The environment that processes are started with, which is this process's own."""
        return os.environ

    @property
    def locals(self) -> SimpleNamespace:
        """The values that handlers and actions have set, as attributes."""
        return SimpleNamespace(**self.get_locals_as_dict())

    def get_locals_as_dict(self) -> dict[str, Any]:
        """Return a copy of the locals; they hide globals of the same name."""
        return {**self._globals, **self._locals}

    def extend_locals(self, extensions: dict[str, Any]) -> None:
        """Add locals that last until the current event is handled."""
        self._locals.update(extensions)

    def extend_globals(self, extensions: dict[str, Any]) -> None:
        """Add locals that last."""
        self._globals.update(extensions)

    @contextmanager
    def _scoped_locals(self) -> Iterator[None]:
        outer = dict(self._locals)
        try:
            yield
        finally:
            self._locals = outer

    def _push_launch_configurations(self) -> None:
        self._configurations_stack.append(dict(self.launch_configurations))

    def _pop_launch_configurations(self) -> None:
        self.launch_configurations = self._configurations_stack.pop()

    def _push_environment(self) -> None:
        self._environment_stack.append(dict(os.environ))

    def _pop_environment(self) -> None:
        self._replace_environment(self._environment_stack.pop())

    def _reset_environment(self) -> None:
        self._replace_environment(self._first_environment)

    def _replace_environment(self, environment: dict[str, str]) -> None:
        os.environ.clear()
        os.environ.update(environment)

    def perform_substitution(self, substitution: Substitution) -> str:
        """Return the text of a substitution."""
        return substitution.perform(self)

    def add_completion_future(self, future: asyncio.Future) -> None:
        """Let the launch service wait for this future before it ends."""
        self._completion_futures.append(future)

    def register_event_handler(
        self, event_handler: BaseEventHandler, append: bool = False
    ) -> None:
        """Add an event handler before, or with append after, the ones there are."""
        if append:
            self._event_handlers.append(event_handler)
        else:
            self._event_handlers.appendleft(event_handler)

    def unregister_event_handler(self, event_handler: BaseEventHandler) -> None:
        """Remove an event handler."""
        self._event_handlers.remove(event_handler)

    def emit_event_sync(self, event: Event) -> None:
        """Queue an event; for the thread that runs the event loop, or any before it runs."""
        self._events.append(event)
        if self._event_emitted is not None:
            self._event_emitted.set()

    async def emit_event(self, event: Event) -> None:
        """Queue an event."""
        self.emit_event_sync(event)
