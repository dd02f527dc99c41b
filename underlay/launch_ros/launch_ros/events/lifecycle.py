"""Events of lifecycle nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from launch import Event
from lifecycle_msgs.msg import Transition, TransitionEvent
from underlay_refusal import refuse

if TYPE_CHECKING:
    from ..actions import LifecycleNode

__all__ = ['ChangeState', 'StateTransition']
__getattr__ = refuse(__name__, __all__)

# The transitions that can be asked for; the others are results.
TRANSITIONS = {
    getattr(Transition, name): name
    for name in (
        'TRANSITION_CREATE',
        'TRANSITION_CONFIGURE',
        'TRANSITION_CLEANUP',
        'TRANSITION_ACTIVATE',
        'TRANSITION_DEACTIVATE',
        'TRANSITION_UNCONFIGURED_SHUTDOWN',
        'TRANSITION_INACTIVE_SHUTDOWN',
        'TRANSITION_ACTIVE_SHUTDOWN',
        'TRANSITION_DESTROY',
    )
}


class ChangeState(Event):
    """The lifecycle nodes that match are to make a transition.

    Parameters
    ----------
    lifecycle_node_matcher
        Tells if a LifecycleNode action is meant.
    transition_id
        A constant of lifecycle_msgs.msg.Transition.

    Raises
    ------
    ValueError
        When there is no such transition.

    """

    name = 'launch_ros.events.lifecycle.ChangeState'

    def __init__(
        self, *, lifecycle_node_matcher: Callable[[LifecycleNode], bool], transition_id: int
    ) -> None:
        if transition_id not in TRANSITIONS:
            names = ', '.join(f'{name}: {id_}' for id_, name in TRANSITIONS.items())
            raise ValueError(
                f"given transition_id of '{transition_id}', expected one of {{{names}}}"
            )
        self.lifecycle_node_matcher = lifecycle_node_matcher
        self.transition_id = transition_id


class StateTransition(Event):
    """A lifecycle node made a transition, between states named by their labels."""

    name = 'launch_ros.events.lifecycle.StateTransition'

    def __init__(self, *, action: LifecycleNode, msg: TransitionEvent) -> None:
        self.action = action
        self.msg = msg
        self.timestamp = msg.timestamp
        self.transition = msg.transition.label
        self.start_state = msg.start_state.label
        self.goal_state = msg.goal_state.label
