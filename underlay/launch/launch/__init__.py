"""Launching of processes, described in Python: what nodlidar's launch file calls of launch."""

from underlay_refusal import refuse

from . import actions, substitutions
from .action import Action
from .launch_context import LaunchContext
from .launch_description import LaunchDescription
from .launch_service import LaunchService
from .substitution import SomeSubstitutionsType, Substitution

__all__ = [
    'Action',
    'LaunchContext',
    'LaunchDescription',
    'LaunchService',
    'SomeSubstitutionsType',
    'Substitution',
    'actions',
    'substitutions',
]
__getattr__ = refuse(__name__, __all__)
