"""The errors of published scans and clouds against the truth."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_LASER_POSE
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.point_layout import xyz_in
from nodlidar_assembler.clouds.points import place, points_of
from nodlidar_common.arrays import Array, Integers
import numpy as np
from numpy.typing import NDArray

from bench.faults.fault_log import Cloud, codes_of, Published, sources
from bench.faults.fault_truth import TrueScan, Truth

_SAME_STAMP_NS = 1_000_000  # between a cloud's stamp and its scan's


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Of every scan and cloud, in the order in which they were published.

    Attributes
    ----------
    source
        The lidar's scan that each published one is, by its number, -1 if none, shape (s,).
    stamp
        Of the scans [s], NaN without a source, shape (s,).
    changed
        Number of beams of each scan that differ from those sent, shape (s,).
    scan_of_cloud
        The published scan of each cloud, by its number, -1 if none, shape (c,).
    cloud
        RMS distance of a cloud's points to their true positions [m], NaN without a source,
        shape (c,).
    """

    source: NDArray[np.intp]
    stamp: Array
    changed: Integers
    scan_of_cloud: NDArray[np.intp]
    cloud: Array


def errors(published: Published, truth: Truth) -> Errors:
    """Return the errors of all scans and clouds."""
    scans = [scan for _, scan in published.scans]
    clouds = [cloud for _, cloud in published.clouds]
    source = sources(published.scans, truth.scans)
    sent = [truth.scans[i] if i >= 0 else None for i in source]
    of_cloud = _scans_of(clouds, scans)
    return Errors(
        source,
        np.array([_stamp_error(s, t) for s, t in zip(scans, sent, strict=True)]),
        np.array([_changed(s, t) for s, t in zip(scans, sent, strict=True)], dtype=np.int64),
        of_cloud,
        np.array(
            [
                np.nan if i < 0 else cloud_error(cloud, scans[i], sent[i])
                for cloud, i in zip(clouds, of_cloud, strict=True)
            ]
        ),
    )


def cloud_error(cloud: Cloud, scan: Scan, sent: TrueScan | None) -> float:
    """Return the RMS distance of a cloud's points to their true positions [m].

    Beams whose range was changed on the wire are left out; Errors.changed counts them.
    """
    if sent is None:
        return float('nan')
    beams = Beams(scan.geometry, REFERENCE_LASER_POSE)
    sound = (codes_of(scan) == sent.codes)[beams.geometry.measured(scan.ranges)]
    placed = place(beams, scan.ranges, sent.pitch)
    true = points_of(placed, beams, int(sent.times_ns[0])).data
    squares = ((cloud.xyz - xyz_in(true)) ** 2).sum(axis=1)[sound]
    return float(np.sqrt(squares.mean())) if squares.size else float('nan')


def _stamp_error(scan: Scan, sent: TrueScan | None) -> float:
    return float('nan') if sent is None else (scan.stamp_ns - int(sent.times_ns[0])) / 1e9


def _changed(scan: Scan, sent: TrueScan | None) -> int:
    return 0 if sent is None else int(np.count_nonzero(codes_of(scan) != sent.codes))


def _scans_of(clouds: list[Cloud], scans: list[Scan]) -> NDArray[np.intp]:
    """Return the scan of each cloud, by the stamp of its first valid beam."""
    found = np.full(len(clouds), -1)
    firsts, sizes = np.empty(len(scans), dtype=np.int64), np.empty(len(scans), dtype=np.int64)
    for i, scan in enumerate(scans):
        beams = Beams(scan.geometry, REFERENCE_LASER_POSE)
        valid = np.flatnonzero(beams.geometry.measured(scan.ranges))
        sizes[i] = valid.size
        firsts[i] = scan.stamp_ns + (int(beams.offset_ns[valid[0]]) if valid.size else 0)
    for i, cloud in enumerate(clouds):
        apart = np.where(sizes == len(cloud.xyz), np.abs(firsts - cloud.stamp_ns), 2**62)
        if apart.size and apart.min() < _SAME_STAMP_NS:
            found[i] = int(apart.argmin())
    return found
