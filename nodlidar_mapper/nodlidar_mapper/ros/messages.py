"""Messages to and from arrays."""

from array import array
from collections.abc import Sequence

from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3,
)
from nav_msgs.msg import OccupancyGrid, Path
from nodlidar_common.arrays import Array
from nodlidar_common.ros.messages import time_message
from nodlidar_mapper.geometry.poses import matrix_from
from nodlidar_mapper.geometry.surface import Surface
from nodlidar_mapper.output.grid import Grid
import numpy as np
from numpy.lib.recfunctions import unstructured_to_structured
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2, PointField
from sensor_msgs_py.point_cloud2 import create_cloud
from std_msgs.msg import Header

SURFACE_FIELDS = ('x', 'y', 'z', 'normal_x', 'normal_y', 'normal_z')  # as PCL names them

FARTHEST = 1e6  # m; of a pose that a person sets


def matrix_of(transform: TransformStamped) -> Array:
    """Return a transform as a matrix from the child frame to its parent."""
    return _matrix(transform.transform.translation, transform.transform.rotation)


def matrix_of_pose(pose: Pose) -> Array:
    """Return a pose as a matrix.

    Raises
    ------
    ValueError
        If it is farther than FARTHEST, not finite, or its orientation is zero.
    """
    matrix = _matrix(pose.position, pose.orientation)
    if not np.abs(matrix).max() <= FARTHEST:
        raise ValueError(f'a pose that is not within {FARTHEST:g} m')
    return matrix


def _matrix(p: Point | Vector3, q: Quaternion) -> Array:
    return matrix_from(Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix(), (p.x, p.y, p.z))


def is_covariance(matrix: Array) -> bool:
    """Return whether a matrix may be a covariance."""
    if not np.abs(matrix).max() <= FARTHEST**2:
        return False
    return bool(np.linalg.eigvalsh((matrix + matrix.T) / 2.0).min() >= -1e-9)


def pose_message(pose: Array) -> Pose:
    """Return a matrix as a pose."""
    message = Pose()
    p, q = message.position, message.orientation
    p.x, p.y, p.z = pose[:3, 3].tolist()
    q.x, q.y, q.z, q.w = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
    return message


def estimate_message(
    pose: Array, covariance: Array, stamp_ns: int, frame: str
) -> PoseWithCovarianceStamped:
    """Return a pose and the covariance of its change (x, y, z, turns about these axes)."""
    message = PoseWithCovarianceStamped(header=header(stamp_ns, frame))
    message.pose.pose = pose_message(pose)
    message.pose.covariance = covariance.ravel().tolist()
    return message


def path_message(stamps_ns: Sequence[int], poses: Array, stamp_ns: int, frame: str) -> Path:
    """Return poses (n, 4, 4) as a path."""
    places = [
        PoseStamped(header=header(at_ns, frame), pose=pose_message(pose))
        for at_ns, pose in zip(stamps_ns, poses, strict=True)
    ]
    return Path(header=header(stamp_ns, frame), poses=places)


def surface_message(surface: Surface, stamp_ns: int, frame: str) -> PointCloud2:
    """Return points with their normals as a cloud."""
    values = np.concatenate([surface.points, surface.normals], axis=1).astype(np.float32)
    data = unstructured_to_structured(values, names=SURFACE_FIELDS)
    fields = [
        PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1)
        for k, name in enumerate(SURFACE_FIELDS)
    ]
    message = create_cloud(header(stamp_ns, frame), fields, data, data.itemsize)
    message.is_dense = True
    return message


def grid_message(grid: Grid, stamp_ns: int, frame: str) -> OccupancyGrid:
    """Return a grid as map_server publishes it."""
    message = OccupancyGrid(header=header(stamp_ns, frame))
    message.info.map_load_time = message.header.stamp
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin.position.x, message.info.origin.position.y = grid.origin
    message.info.origin.orientation.w = 1.0
    message.data = array('b', np.ascontiguousarray(grid.cells, dtype=np.int8).tobytes())
    return message


def header(stamp_ns: int, frame: str) -> Header:
    """Return a header."""
    return Header(stamp=time_message(stamp_ns), frame_id=frame)
