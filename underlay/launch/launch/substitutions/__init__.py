"""Texts that are known only while launching."""

from underlay_refusal import refuse

from .compare import EqualsSubstitution, IfElseSubstitution, NotEqualsSubstitution
from .look_up import Command, EnvironmentVariable, FindExecutable
from .substitution_failure import SubstitutionFailure
from .text import LaunchConfiguration, PathJoinSubstitution, TextSubstitution

__all__ = [
    'Command',
    'EnvironmentVariable',
    'EqualsSubstitution',
    'FindExecutable',
    'IfElseSubstitution',
    'LaunchConfiguration',
    'NotEqualsSubstitution',
    'PathJoinSubstitution',
    'SubstitutionFailure',
    'TextSubstitution',
]
__getattr__ = refuse(__name__, __all__)
