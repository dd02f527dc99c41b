"""Points as a PointCloud2 message."""

from array import array

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.points import fields, layout, MOVED_POINT, POINT
from nodlidar_common.ros.messages import time_message
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

_KEYS = ('name', 'offset', 'datatype', 'count')
_FIELDS = {
    point: [PointField(**dict(zip(_KEYS, field, strict=True))) for field in fields(point)]
    for point in (POINT, MOVED_POINT)
}


def cloud_message(points: Points, frame_id: str) -> PointCloud2:
    """Return an unorganised, dense cloud; the points' bytes are copied once."""
    message = PointCloud2(fields=_FIELDS[points.data.dtype], **layout(points.data))
    message.header.stamp = time_message(points.time_ns[0])
    message.header.frame_id = frame_id
    # Only an array of bytes is not checked element by element.
    data = array('B')
    data.frombytes(points.data.view(np.uint8).data)
    message.data = data
    return message
