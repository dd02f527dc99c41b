"""The parts of beams that are in a band of heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_assembler.clouds.deskew import as_of
from nodlidar_assembler.clouds.ego_motion import Poses
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.clouds.points import nod_in_place, place
from nodlidar_common.arrays import Array, Mask, Times
import numpy as np
from numpy.typing import NDArray

_LEAST_RISE = 1e-9  # m


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """The parts of beams in the band, each in the level frame at its instant.

    Attributes
    ----------
    time_ns
        Ascending, shape (n,).
    begin, end
        Where the beam enters the band, and where it leaves it or ends [m], shape (n, 3).
    hit
        Whether it ends at a surface there, shape (n,).
    poses
        Of the level frame in that of odometry, shape (n,); None if the robot stands.
    """

    time_ns: Times
    begin: Array
    end: Array
    hit: Mask
    poses: Poses | None

    def __getitem__(self, chosen: slice | NDArray[np.intp]) -> Segments:
        poses = None if self.poses is None else self.poses[chosen]
        return Segments(
            self.time_ns[chosen], self.begin[chosen], self.end[chosen], self.hit[chosen], poses
        )

    def between(self, begin_ns: int, end_ns: int) -> Segments:
        """Return those after one instant, up to another [ns]."""
        first, last = np.searchsorted(self.time_ns, [begin_ns, end_ns], side='right')
        return self[first:last]

    @classmethod
    def joined(cls, parts: Sequence[Segments]) -> Segments:
        """Return segments one after the other; without poses if a part has none."""
        poses = [part.poses for part in parts if part.poses is not None]
        return cls(
            np.concatenate([part.time_ns for part in parts]),
            np.concatenate([part.begin for part in parts]),
            np.concatenate([part.end for part in parts]),
            np.concatenate([part.hit for part in parts]),
            Poses.joined(poses) if len(poses) == len(parts) else None,
        )

    def in_plane(self) -> tuple[Array, Array]:
        """Return where they begin and end as of the last instant, x and y [m], (n, 2) each."""
        begin, end = self.begin, self.end
        if self.poses is not None:
            begin, end = as_of(begin, self.poses), as_of(end, self.poses)
        return begin[:, :2], end[:, :2]


def segments_in_band(
    assembled: Assembled,
    band: tuple[float, float],
    reach: float,
    lost_are_free: bool,
    levelled: Array,
) -> Segments:
    """Return the segments in a band of the beams that hit, or return nothing in range.

    Parameters
    ----------
    assembled
        A scan. Beams that are too near, or mixed pixels, count as neither.
    band
        Lowest and highest z in the level frame, whose origin is that of nodlidar_base_link [m].
    reach
        Longest way of a beam that returns nothing [m], if the lidar sees that far.
    lost_are_free
        Whether beams that the lidar lost (NaN) return nothing in range.
    levelled
        Rotation from nodlidar_base_link to the level frame, shape (3, 3).
    """
    beams, pitch, ranges = assembled.beams, assembled.pitch, assembled.scan.ranges
    nothing = np.isposinf(ranges) | (np.isnan(ranges) & lost_are_free)
    reach = min(reach, beams.geometry.range_max)
    free = place(beams, np.where(nothing, np.float32(reach), np.float32(np.nan)), pitch)
    which = np.concatenate([assembled.placed.indices, free.indices])
    order = np.argsort(which)
    which = which[order]
    end = np.concatenate([assembled.placed.xyz, free.xyz], axis=1)[:, order].T @ levelled.T
    centres = np.repeat(beams.laser_pose.position[:, None], len(which), axis=1)
    begin = nod_in_place(centres, pitch[which]).T @ levelled.T
    enters, leaves = _within(begin[:, 2], end[:, 2], band)
    way = end - begin
    segments = Segments(
        assembled.scan.stamp_ns + beams.offset_ns[which],
        begin + enters[:, None] * way,
        begin + leaves[:, None] * way,
        ~nothing[which] & (leaves == 1.0),
        None if assembled.poses is None else assembled.poses[which].turned(levelled.T),
    )
    return segments[np.flatnonzero(enters < leaves)]


def _within(begin: Array, end: Array, band: tuple[float, float]) -> tuple[Array, Array]:
    """Return from where to where, 0 to 1, ways between heights [m] are in a band of heights.

    A way that is never in the band enters it after it leaves it.
    """
    rise = end - begin
    rise = np.where(np.abs(rise) < _LEAST_RISE, _LEAST_RISE, rise)
    one, other = (band[0] - begin) / rise, (band[1] - begin) / rise
    return np.maximum(np.minimum(one, other), 0.0), np.minimum(np.maximum(one, other), 1.0)
