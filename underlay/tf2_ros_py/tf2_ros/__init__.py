"""Transforms between frames over time, received and sent: what nodlidar calls of Jazzy's API."""

from tf2_ros.buffer import Buffer
from tf2_ros.exceptions import TransformException
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster
from tf2_ros.transform_broadcaster import TransformBroadcaster
from tf2_ros.transform_listener import TransformListener
from underlay_refusal import refuse

__all__ = [
    'Buffer',
    'StaticTransformBroadcaster',
    'TransformBroadcaster',
    'TransformException',
    'TransformListener',
]
__getattr__ = refuse(__name__, __all__)
