"""ROS nodes in launch descriptions: what nodlidar's launch file calls of launch_ros."""

from underlay_refusal import refuse

from . import actions, parameter_descriptions, substitutions

__all__ = ['actions', 'parameter_descriptions', 'substitutions']
__getattr__ = refuse(__name__, __all__)
