"""Launching of processes, described in Python: what nodlidar's launch file calls of launch."""

from underlay_refusal import refuse

from . import actions, event_handlers
from .launch_context import LaunchContext
from .launch_description import LaunchDescription
from .launch_service import LaunchService

__all__ = ['LaunchContext', 'LaunchDescription', 'LaunchService', 'actions', 'event_handlers']
__getattr__ = refuse(__name__, __all__)
