"""ROS nodes, and what holds for several of them."""

from underlay_refusal import refuse

from .lifecycle_node import LifecycleNode
from .node import Node
from .scopes import PushROSNamespace, SetParameter

__all__ = [
    'LifecycleNode',
    'Node',
    'PushROSNamespace',
    'PushRosNamespace',
    'SetParameter',
]
PushRosNamespace = PushROSNamespace
__getattr__ = refuse(__name__, __all__)
