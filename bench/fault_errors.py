"""How far off what was published is from what really happened."""

from dataclasses import dataclass

from nodlidar_assembler.clouds.assembly import assemble, valid_beams
from nodlidar_assembler.clouds.geometry import Beams, REFERENCE_MOUNT
from nodlidar_assembler.clouds.pipeline import Scan
import numpy as np
from numpy.typing import NDArray

from bench.fault_log import Cloud, codes_of, Published, sources
from bench.fault_truth import TrueScan, Truth

_SAME_STAMP_NS = 1_000_000  # between a cloud's stamp and its scan's


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Of every message, in the order in which they were published.

    Attributes
    ----------
    source
        Which of the lidar's scans each published one is, -1 if none, shape (s,).
    stamp
        Of the scans [s], NaN without a source, shape (s,).
    changed
        Beams of each scan that are not what was sent, shape (s,).
    scan_of_cloud
        Which published scan each cloud is made of, -1 if none, shape (c,).
    cloud
        RMS distance of a cloud's points to where they truly were [m], NaN without a source,
        shape (c,).
    joint
        Of the pitch at the stamp of each joint state [rad], shape (j,).
    """

    source: NDArray[np.intp]
    stamp: NDArray[np.float64]
    changed: NDArray[np.int64]
    scan_of_cloud: NDArray[np.intp]
    cloud: NDArray[np.float64]
    joint: NDArray[np.float64]


def errors(published: Published, truth: Truth) -> Errors:
    """Return the errors of all that was published."""
    scans = [scan for _, scan in published.scans]
    clouds = [cloud for _, cloud in published.clouds]
    source = sources(published.scans, truth.scans)
    sent = [truth.scans[i] if i >= 0 else None for i in source]
    of_cloud = _scans_of(clouds, scans)
    joint = published.joint_pitch - truth.pitch(published.joint_stamp_ns)
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
        joint,
    )


def cloud_error(cloud: Cloud, scan: Scan, sent: TrueScan | None) -> float:
    """Return the RMS distance of a cloud's points to where the lidar truly measured them [m].

    A beam whose range was changed on its way counts elsewhere and is left out.
    """
    if sent is None:
        return float('nan')
    beams = Beams(scan.geometry, REFERENCE_MOUNT)
    told = valid_beams(beams, scan.ranges)
    sound = (codes_of(scan) == sent.codes)[told]
    true = assemble(beams, int(sent.times_ns[0]), scan.ranges, sent.pitch).data
    xyz = np.stack([true[axis] for axis in 'xyz'], axis=1)
    squares = ((cloud.xyz - xyz) ** 2).sum(axis=1)[sound]
    return float(np.sqrt(squares.mean())) if squares.size else float('nan')


def _stamp_error(scan: Scan, sent: TrueScan | None) -> float:
    return float('nan') if sent is None else (scan.stamp_ns - int(sent.times_ns[0])) / 1e9


def _changed(scan: Scan, sent: TrueScan | None) -> int:
    return 0 if sent is None else int(np.count_nonzero(codes_of(scan) != sent.codes))


def _scans_of(clouds: list[Cloud], scans: list[Scan]) -> NDArray[np.intp]:
    """Return the scan that each cloud is made of: by the stamp of its first valid beam."""
    found = np.full(len(clouds), -1)
    firsts, sizes = np.empty(len(scans), dtype=np.int64), np.empty(len(scans), dtype=np.int64)
    for i, scan in enumerate(scans):
        beams = Beams(scan.geometry, REFERENCE_MOUNT)
        valid = valid_beams(beams, scan.ranges)
        sizes[i] = valid.size
        firsts[i] = scan.stamp_ns + (int(beams.offset_ns[valid[0]]) if valid.size else 0)
    for i, cloud in enumerate(clouds):
        apart = np.where(sizes == len(cloud.xyz), np.abs(firsts - cloud.stamp_ns), 2**62)
        if apart.size and apart.min() < _SAME_STAMP_NS:
            found[i] = int(apart.argmin())
    return found
