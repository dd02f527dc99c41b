"""Points as a PointCloud2 message."""

from nodlidar_assembler.clouds.point_layout import fields, WITH_SIGMA
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.ros.messages import time_message
from sensor_msgs.msg import PointCloud2, PointField
from sensor_msgs_py.point_cloud2 import create_cloud
from std_msgs.msg import Header

_KEYS = ('name', 'offset', 'datatype', 'count')
_FIELDS = {
    point: [PointField(**dict(zip(_KEYS, field, strict=True))) for field in fields(point)]
    for point in (*WITH_SIGMA.keys(), *WITH_SIGMA.values())
}


def cloud_message(points: Points, frame_id: str) -> PointCloud2:
    """Return an unorganised, dense cloud; the points' bytes are copied once."""
    header = Header(stamp=time_message(points.stamp_ns), frame_id=frame_id)
    message = create_cloud(header, _FIELDS[points.data.dtype], points.data, points.data.itemsize)
    message.is_dense = True  # create_cloud clears it
    return message
