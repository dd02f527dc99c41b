"""Handlers of the common events: what they visit is given, or returned by a function."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from underlay_refusal import refuse

from .event import Event
from .event_handler import BaseEventHandler, entities_list, EntitiesOrNone
from .events import Shutdown
from .events.process import ProcessExited, ProcessStarted
from .launch_description_entity import LaunchDescriptionEntity

if TYPE_CHECKING:
    from .actions import ExecuteProcess
    from .launch_context import LaunchContext

    Reaction = EntitiesOrNone | Callable[[Any, LaunchContext], EntitiesOrNone]
    Target = ExecuteProcess | Callable[[ExecuteProcess], bool] | None

__all__ = ['OnProcessExit', 'OnProcessStart', 'OnShutdown']
__getattr__ = refuse(__name__, __all__)


class _Reacting(BaseEventHandler):
    def __init__(
        self, matcher: Callable[[Event], bool], reaction: Reaction, handle_once: bool
    ) -> None:
        super().__init__(matcher=matcher, handle_once=handle_once)
        self._react = reaction if callable(reaction) else None
        self._entities = [] if callable(reaction) else entities_list(reaction)

    def describe(self) -> tuple[str, list[LaunchDescriptionEntity]]:
        return super().describe()[0], self._entities

    def handle(self, event: Event, context: LaunchContext) -> EntitiesOrNone:
        super().handle(event, context)
        return self._react(event, context) if self._react else self._entities


def _matcher(event_type: type[Event], target: Target) -> Callable[[Any], bool]:
    from .actions import ExecuteProcess

    if callable(target):
        return lambda event: isinstance(event, event_type) and target(event.action)
    if isinstance(target, ExecuteProcess):
        return lambda event: isinstance(event, event_type) and event.action is target
    if target is not None:
        raise TypeError(f"expected an 'ExecuteProcess' or a function, got {target!r}")
    return lambda event: isinstance(event, event_type)


class OnProcessExit(_Reacting):
    """Reacts to the end of a process, or with target_action None of any."""

    def __init__(
        self, *, target_action: Target = None, on_exit: Reaction, handle_once: bool = False
    ) -> None:
        super().__init__(_matcher(ProcessExited, target_action), on_exit, handle_once)


class OnProcessStart(_Reacting):
    """Reacts to the start of a process, or with target_action None of any."""

    def __init__(
        self, *, target_action: Target = None, on_start: Reaction, handle_once: bool = False
    ) -> None:
        super().__init__(_matcher(ProcessStarted, target_action), on_start, handle_once)


class OnShutdown(_Reacting):
    """Reacts to the shutdown of all that was launched."""

    def __init__(self, *, on_shutdown: Reaction, handle_once: bool = False) -> None:
        super().__init__(lambda event: isinstance(event, Shutdown), on_shutdown, handle_once)
