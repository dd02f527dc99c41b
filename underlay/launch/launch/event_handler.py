"""Handlers of events, in general."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from .event import Event
from .launch_description_entity import LaunchDescriptionEntity, SomeEntitiesType

if TYPE_CHECKING:
    from .launch_context import LaunchContext

EntitiesOrNone = SomeEntitiesType | None


def entities_list(entities: EntitiesOrNone) -> list[LaunchDescriptionEntity]:
    """Return a list of one entity, of several, or of none.

    Raises
    ------
    TypeError
        When there is something else than entities.

    """
    if entities is None:
        return []
    found = list(entities) if isinstance(entities, Iterable) else [entities]
    for entity in found:
        if not isinstance(entity, LaunchDescriptionEntity):
            raise TypeError(f"expected a 'LaunchDescriptionEntity', got {entity!r}")
    return found


class BaseEventHandler:
    """Handles the events that match.

    Parameters
    ----------
    matcher
        Tells if an event is handled.
    handle_once
        Whether the handler is removed once it handled an event.

    """

    def __init__(self, *, matcher: Callable[[Event], bool], handle_once: bool = False) -> None:
        self._matcher = matcher
        self.handle_once = handle_once

    def matches(self, event: Event) -> bool:
        """Tell if the event is one for this handler."""
        return self._matcher(event)

    def describe(self) -> tuple[str, list[LaunchDescriptionEntity]]:
        """Return a text, and the entities that are known to be visited on the event."""
        return f'{type(self).__name__}(handle_once={self.handle_once})', []

    def handle(self, event: Event, context: LaunchContext) -> EntitiesOrNone:
        """Handle the event, and return the entities to visit; context.locals.event has it."""
        context.extend_locals({'event': event})
        if self.handle_once:
            context.unregister_event_handler(self)
        return None


class EventHandler(BaseEventHandler):
    """Visits entities on the events that match."""

    def __init__(
        self,
        *,
        matcher: Callable[[Event], bool],
        entities: EntitiesOrNone = None,
        handle_once: bool = False,
    ) -> None:
        super().__init__(matcher=matcher, handle_once=handle_once)
        self.entities = entities_list(entities)

    def describe(self) -> tuple[str, list[LaunchDescriptionEntity]]:
        """Return a text and the entities."""
        return super().describe()[0], self.entities

    def handle(self, event: Event, context: LaunchContext) -> EntitiesOrNone:
        """Return the entities."""
        super().handle(event, context)
        return self.entities
