"""Reactions to what happens in a launch."""

from collections.abc import Callable
from typing import Any

from underlay_refusal import Partial, refuse, refuse_arguments

from .action import Action
from .event_types import ProcessStarted, Shutdown
from .launch_context import LaunchContext

__all__ = ['OnProcessStart', 'OnShutdown']
__getattr__ = refuse(__name__, __all__)

Reaction = Callable[[Any, LaunchContext], Action | None]


class OnProcessStart(Partial):
    """Call a function of event and context when the process of an action has started."""

    def __init__(self, *, target_action: Action, on_start: Reaction, **uncovered: Any) -> None:
        refuse_arguments('OnProcessStart', uncovered)
        self._target_action = target_action
        self.react = on_start

    def matches(self, event: Any) -> bool:
        """Return whether the event is the start of the process."""
        return isinstance(event, ProcessStarted) and event.action is self._target_action


class OnShutdown(Partial):
    """Call a function of event and context when the launch begins to shut down."""

    def __init__(self, *, on_shutdown: Reaction, **uncovered: Any) -> None:
        refuse_arguments('OnShutdown', uncovered)
        self.react = on_shutdown

    def matches(self, event: Any) -> bool:
        """Return whether the event is the shutdown."""
        return isinstance(event, Shutdown)
