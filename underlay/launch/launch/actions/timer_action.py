"""Actions for later."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any

from ..action import Action
from ..event_handler import EventHandler
from ..event_handlers import OnShutdown
from ..events import TimerEvent
from ..launch_context import LaunchContext
from ..launch_description_entity import LaunchDescriptionEntity
from ..substitution import SomeSubstitutionsType, Substitution
from ..utilities.type_utils import normalize_typed_substitution, perform_typed_substitution
from .simple import OpaqueFunction


class TimerAction(Action):
    """Visit actions once a period is over, unless cancelled before.

    Parameters
    ----------
    period
        Seconds, as a float or as substitutions.
    actions
        What to visit then.
    cancel_on_shutdown
        Whether a shutdown cancels the timer.

    """

    def __init__(
        self,
        *,
        period: float | SomeSubstitutionsType,
        actions: Iterable[LaunchDescriptionEntity],
        cancel_on_shutdown: bool | SomeSubstitutionsType = True,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        if isinstance(period, str):
            period = float(period)
        if not isinstance(period, (float, Substitution, Iterable)):
            raise TypeError(f"period: expected a 'float' or substitutions, got {period!r}")
        self.period = normalize_typed_substitution(period, float)
        self.actions = list(actions)
        self._cancel_on_shutdown = normalize_typed_substitution(cancel_on_shutdown, bool)
        self._cancelled = asyncio.Event()
        self._task: asyncio.Task | None = None

    def describe(self) -> str:
        """Describe the timer."""
        return f'TimerAction(period={self.period}, actions=<actions>)'

    def describe_conditional_sub_entities(
        self,
    ) -> list[tuple[str, Iterable[LaunchDescriptionEntity]]]:
        """Return the actions."""
        return [(f'{self.period} seconds pass without being canceled', self.actions)]

    def cancel(self) -> None:
        """Cancel the timer, at any time."""
        self._cancelled.set()

    def execute(self, context: LaunchContext) -> None:
        """Start the timer."""
        if self._cancelled.is_set():
            return
        period = perform_typed_substitution(context, self.period, float)
        self._task = context.asyncio_loop.create_task(self._wait(context, period))
        context.register_event_handler(self._handler(context.get_locals_as_dict()))
        if perform_typed_substitution(context, self._cancel_on_shutdown, bool):
            context.register_event_handler(OnShutdown(on_shutdown=lambda *_: self.cancel()))

    def _handler(self, locals_then: dict[str, Any]) -> EventHandler:
        def visit(context: LaunchContext) -> list[LaunchDescriptionEntity]:
            context.extend_locals(locals_then)
            return self.actions

        return EventHandler(
            matcher=lambda event: isinstance(event, TimerEvent) and event.timer_action is self,
            entities=OpaqueFunction(function=visit),
            handle_once=True,
        )

    async def _wait(self, context: LaunchContext, period: float) -> None:
        try:
            await asyncio.wait_for(self._cancelled.wait(), period)
        except TimeoutError:
            context.emit_event_sync(TimerEvent(timer_action=self))

    def get_asyncio_future(self) -> asyncio.Future | None:
        """Return what is done when the timer is."""
        return self._task
