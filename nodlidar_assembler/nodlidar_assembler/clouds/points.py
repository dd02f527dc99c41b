"""Points from a scan and the pitch and pose of its beams."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.geometry import Beams
from nodlidar_assembler.clouds.origins import OF_ODOMETRY, Origin, origin_near
from nodlidar_assembler.clouds.point_layout import MOVED_POINT, POINT, WITH_SIGMA, xyz_in
from nodlidar_common.arrays import Array, Times
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Points:
    """Points in nodlidar_base_link or in the frame of odometry; oldest first.

    Attributes
    ----------
    time_ns
        Instant of each point [ns], shape (n,), ascending within a scan.
    data
        Array of POINT, MOVED_POINT or DESKEWED_POINT, or of these WITH_SIGMA, shape (n,); ``time``
        counts from the first point.
    origin
        Origin of the coordinates in the frame of odometry [m], see `origins`.
    poses
        Poses of nodlidar_base_link in the frame of odometry at each point's instant, by which
        points of several instants are still to be joined, shape (n,); else None.
    stamp_ns
        Instant of the cloud [ns]; by default that of the first point.
    """

    time_ns: Times
    data: NDArray[np.void]
    origin: Origin = OF_ODOMETRY
    poses: Poses | None = None
    stamp_ns: int = -1

    def __post_init__(self) -> None:
        if self.stamp_ns < 0 and len(self.time_ns):
            object.__setattr__(self, 'stamp_ns', int(self.time_ns[0]))

    def __getitem__(self, chosen: slice | NDArray[np.intp]) -> 'Points':
        poses = None if self.poses is None else self.poses[chosen]
        return Points(self.time_ns[chosen], self.data[chosen], self.origin, poses)

    @property
    def xyz(self) -> Array:
        """Coordinates from the origin of the frame itself [m], shape (n, 3)."""
        return np.asarray(xyz_in(self.data) + self.origin)

    def data_from(self, origin: Origin) -> NDArray[np.void]:
        """Return the data in coordinates from another origin, shape (n,)."""
        if origin == self.origin:
            return self.data
        data = self.data.copy()
        for axis, old, new in zip('xyz', self.origin, origin, strict=True):
            data[axis] += old - new
        return data


@dataclass(frozen=True, slots=True)
class Placed:
    """The beams of a scan with a measurement, and their end points.

    Attributes
    ----------
    indices
        Of the beams in the scan, shape (n,).
    xyz
        End points in nodlidar_base_link [m], shape (3, n).
    sigma
        Expected errors of the end points [m], shape (n,); None if they are not wanted.
    """

    indices: NDArray[np.intp]
    xyz: Array
    sigma: Array | None = None


def place(beams: Beams, ranges: NDArray[np.float32], pitch: Array) -> Placed:
    """Return the end points of a scan's beams in nodlidar_base_link.

    A beam ends at ``direction * r + laser_pose.position`` in the nodding frame, which the nod
    turns. With the lidar z_off above the axis, this is the transform of docs/model.md, erratum 2
    included.

    Parameters
    ----------
    beams
        Beams of the scan in the nodding frame.
    ranges
        Ranges as in the LaserScan [m], shape (n,).
    pitch
        Pitch of each beam [rad], shape (n,).
    """
    valid = np.flatnonzero(beams.geometry.measured(ranges))
    xyz = beams.direction.take(valid, axis=1)
    xyz *= ranges.take(valid)
    xyz += beams.laser_pose.position[:, None]
    return Placed(valid, nod_in_place(xyz, pitch.take(valid)))


def nod_in_place(xyz: Array, pitch: Array) -> Array:
    """Turn points of the nodding frame by the nod, in place; return them in nodlidar_base_link.

    A pitch phi (positive up) turns about -y, to ``x cos(phi) - z sin(phi)``, ``y``,
    ``x sin(phi) + z cos(phi)``.

    Parameters
    ----------
    xyz
        Points [m], shape (3, n) or, with several of the same pitch, (3, k, n).
    pitch
        Pitch of the nod at each [rad], shape (n,).
    """
    cos, sin = np.cos(pitch), np.sin(pitch)
    xyz[0], xyz[2] = xyz[0] * cos - xyz[2] * sin, xyz[0] * sin + xyz[2] * cos
    return xyz


def points_of(
    placed: Placed,
    beams: Beams,
    start_ns: int,
    intensities: NDArray[np.float32] | None = None,
    poses: Poses | None = None,
    point: np.dtype[np.void] | None = None,
) -> Points:
    """Return the points of a scan, in nodlidar_base_link or, with `poses`, in that of odometry.

    In the frame of odometry, coordinates count from an origin near the first pose.

    Parameters
    ----------
    placed, beams
        End points of the beams, and all beams of the scan.
    start_ns
        Instant of the first beam [ns].
    intensities
        Intensities as in the LaserScan; the field is 0 unless there is one per beam.
    poses
        Poses of nodlidar_base_link in the frame of odometry at each beam's instant, shape (n,).
    point
        Type of the points; by default POINT, with `poses` MOVED_POINT, without times. If there
        are expected errors, they are added.

    Raises
    ------
    OdometryError
        If a pose is too far away to resolve millimetres.
    """
    valid, xyz = placed.indices, placed.xyz
    point = point or (POINT if poses is None else MOVED_POINT)
    data = np.zeros(len(valid), dtype=point if placed.sigma is None else WITH_SIGMA[point])
    origin = OF_ODOMETRY
    if poses is not None:
        origin = origin_near(poses.position[0].tolist())
        xyz = poses.take(valid).to_parent(xyz.T, origin).T
    data['x'], data['y'], data['z'] = xyz
    if intensities is not None and len(intensities) == beams.geometry.beams:
        data['intensity'] = intensities.take(valid)
    if point == POINT:
        offset = beams.offset.take(valid)
        data['time'] = offset - offset[:1]
    if placed.sigma is not None:
        data['sigma'] = placed.sigma
    return Points(start_ns + beams.offset_ns.take(valid), data, origin)
