"""One scan and the pitch of its beams become points."""

from dataclasses import dataclass

from nodlidar_assembler.geometry import Beams
from nodlidar_assembler.points import POINT
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Points:
    """Points in the frame of the nod's base, oldest first.

    Attributes
    ----------
    time_ns
        Instant of each point [ns], ascending, shape (n,).
    data
        Array of POINT, shape (n,); the field ``time`` counts from the first point.
    """

    time_ns: NDArray[np.int64]
    data: NDArray[np.void]


def valid_beams(beams: Beams, ranges: NDArray[np.float32]) -> NDArray[np.intp]:
    """Return the indices of the beams that measured something (REP 117: neither inf nor NaN)."""
    geometry = beams.geometry
    return np.flatnonzero((ranges >= geometry.range_min) & (ranges <= geometry.range_max))


def assemble(
    beams: Beams,
    start_ns: int,
    ranges: NDArray[np.float32],
    pitch: NDArray[np.float64],
    intensities: NDArray[np.float32] | None = None,
) -> Points:
    """Return a scan's points in nodlidar_base_link; beams without a measurement are absent.

    A beam ends at ``p = direction * r + mount.position`` in the nodding frame; the nod by phi
    (positive up) about -y takes it to ``x = p_x cos(phi) - p_z sin(phi)``, ``y = p_y``,
    ``z = p_x sin(phi) + p_z cos(phi)``. With the mount z_off above the axis that is the transform
    of docs/model.md, erratum 2 included.

    Parameters
    ----------
    beams
        Geometry of the scan.
    start_ns
        Instant of the first beam [ns].
    ranges, intensities
        As in the LaserScan, shape (n,); without intensities the field is 0.
    pitch
        Pitch of each beam [rad], shape (n,).
    """
    valid = valid_beams(beams, ranges)
    p = beams.direction[:, valid]
    p *= ranges[valid]
    p += beams.mount.position[:, None]
    phi = pitch[valid]
    cos, sin = np.cos(phi), np.sin(phi)
    data = np.zeros(len(valid), dtype=POINT)
    data['x'] = p[0] * cos - p[2] * sin
    data['y'] = p[1]
    data['z'] = p[0] * sin + p[2] * cos
    if intensities is not None and len(intensities) == len(ranges):
        data['intensity'] = intensities[valid]
    offset = beams.offset[valid]
    data['time'] = offset - offset[:1]
    return Points(start_ns + beams.offset_ns[valid], data)
