"""Events of ROS nodes."""

from collections.abc import Callable
from typing import Any

from underlay_refusal import refuse

from . import lifecycle

__all__ = ['lifecycle', 'matches_node_name']
__getattr__ = refuse(__name__, __all__)


def matches_node_name(node_name: str) -> Callable[[Any], bool]:
    """Return a matcher of nodes of this full name."""
    full_name = node_name if node_name.startswith('/') else f'/{node_name}'
    return lambda action: action.node_name == full_name
