"""ROS nodes as actions."""

from underlay_refusal import refuse

from .node import Node

__all__ = ['Node']
__getattr__ = refuse(__name__, __all__)
