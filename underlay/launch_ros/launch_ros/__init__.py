"""ROS nodes in launch descriptions: what nodlidar's launch files call of launch_ros."""

from underlay_refusal import refuse

from . import actions, event_handlers, events, parameter_descriptions, substitutions

__all__ = ['actions', 'event_handlers', 'events', 'parameter_descriptions', 'substitutions']
__getattr__ = refuse(__name__, [*__all__, 'descriptions'])
