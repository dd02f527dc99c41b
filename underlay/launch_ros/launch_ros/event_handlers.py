"""Handlers of lifecycle transitions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from launch import Event, EventHandler, SomeEntitiesType
from underlay_refusal import refuse

from .actions import LifecycleNode
from .events.lifecycle import StateTransition

__all__ = ['OnStateTransition']
__getattr__ = refuse(__name__, __all__)


class OnStateTransition(EventHandler):
    """Visits entities when a lifecycle node makes a transition.

    Parameters
    ----------
    entities
        What to visit.
    target_lifecycle_node
        The node; None matches any.
    transition, start_state, goal_state
        Labels, as 'configure', 'unconfigured', 'inactive'; None matches any.
    matcher
        Function of the event to use instead of all these.

    """

    def __init__(
        self,
        *,
        entities: SomeEntitiesType,
        target_lifecycle_node: LifecycleNode | None = None,
        transition: str | None = None,
        start_state: str | None = None,
        goal_state: str | None = None,
        matcher: Callable[[Event], bool] | None = None,
        **kwargs: Any,
    ) -> None:
        if not isinstance(target_lifecycle_node, (LifecycleNode, type(None))):
            raise RuntimeError("OnStateTransition requires a 'LifecycleNode' action as the target")
        wanted = {
            'action': target_lifecycle_node,
            'transition': transition,
            'start_state': start_state,
            'goal_state': goal_state,
        }

        def matches(event: Event) -> bool:
            return isinstance(event, StateTransition) and all(
                value is None or getattr(event, key) == value for key, value in wanted.items()
            )

        super().__init__(matcher=matcher or matches, entities=entities, **kwargs)
