"""Events of launching."""

from collections.abc import Callable

from underlay_refusal import refuse

from ..action import Action
from ..event import Event
from ..launch_description_entity import LaunchDescriptionEntity
from . import process

__all__ = ['IncludeLaunchDescription', 'Shutdown', 'TimerEvent', 'matches_action', 'process']
__getattr__ = refuse(__name__, __all__)


def matches_action(target_action: Action) -> Callable[[Action], bool]:
    """Return a matcher of exactly this action."""
    return lambda action: action is target_action


class IncludeLaunchDescription(Event):
    """A launch description is to be visited."""

    name = 'launch.events.IncludeLaunchDescription'

    def __init__(self, launch_description: LaunchDescriptionEntity) -> None:
        self.launch_description = launch_description


class Shutdown(Event):
    """All that was launched is to end."""

    name = 'launch.events.Shutdown'

    def __init__(self, *, reason: str = 'reason not given', due_to_sigint: bool = False) -> None:
        self.reason = reason
        self.due_to_sigint = due_to_sigint


class TimerEvent(Event):
    """A timer's period is over."""

    name = 'launch.events.TimerEvent'

    def __init__(self, *, timer_action: Action) -> None:
        self.timer_action = timer_action
