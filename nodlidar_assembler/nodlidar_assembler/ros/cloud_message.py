"""Points as a PointCloud2 message."""

from array import array

from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.points import MOVED_POINT, POINT
from nodlidar_common.ros.messages import time_message
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

_TYPES = {np.dtype(np.float32): PointField.FLOAT32, np.dtype(np.uint16): PointField.UINT16}
_FIELDS = {
    point: [
        PointField(name=name, offset=offset, datatype=_TYPES[dtype], count=1)
        for name, (dtype, offset, *_) in (point.fields or {}).items()
    ]
    for point in (POINT, MOVED_POINT)
}


def cloud_message(points: Points, frame_id: str) -> PointCloud2:
    """Return an unorganised, dense cloud; the points' bytes are copied once."""
    message = PointCloud2(
        height=1,
        width=len(points.data),
        fields=_FIELDS[points.data.dtype],
        is_bigendian=False,
        point_step=points.data.itemsize,
        row_step=points.data.nbytes,
        is_dense=True,
    )
    message.header.stamp = time_message(points.time_ns[0])
    message.header.frame_id = frame_id
    # An array of bytes is taken as it is; anything else would be checked element by element.
    data = array('B')
    data.frombytes(points.data.view(np.uint8).data)
    message.data = data
    return message
