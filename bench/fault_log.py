"""What a sensor published, from its bag: scans, clouds, joint states, diagnostics."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.points import POINT
from nodlidar_assembler.inputs.scan_message import scan_from_message
from nodlidar_common.stamps import time_ns
import numpy as np
from numpy.typing import NDArray

from bench.fault_truth import TrueScan

TOPICS = ('scan', 'points', 'joint_states', 'diagnostics')


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """A cloud: its stamp [ns] and points [m], shape (n, 3)."""

    stamp_ns: int
    xyz: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Status:
    """A diagnostic status; level 0 is OK."""

    time_ns: int
    name: str
    level: int
    message: str
    values: dict[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class Published:
    """What was published, and when [ns].

    Attributes
    ----------
    scans, clouds
        With the times at which they were published, ascending.
    joint_ns, joint_stamp_ns, joint_pitch
        When joint states were published [ns], their stamps [ns], their pitch [rad], shape (j,).
    statuses
        In the order of their times.
    """

    scans: list[tuple[int, Scan]]
    clouds: list[tuple[int, Cloud]]
    joint_ns: NDArray[np.int64]
    joint_stamp_ns: NDArray[np.int64]
    joint_pitch: NDArray[np.float64]
    statuses: list[Status]


def read_published(bag: Path) -> Published:
    """Return what a bag holds; raises BagError if it cannot be read to its end."""
    messages: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in TOPICS}
    for recorded in messages_of(bag, lambda topic, kind: topic.lstrip('/') in TOPICS):
        message = _taken(recorded.message, recorded.topic.lstrip('/'), recorded.time_ns)
        messages[recorded.topic.lstrip('/')].append((recorded.time_ns, message))
    for each in messages.values():
        each.sort(key=lambda entry: entry[0])
    joints = [(t, stamp_ns, pitch) for t, (stamp_ns, pitch) in messages['joint_states']]
    told = np.array(joints, dtype=[('time', 'i8'), ('stamp', 'i8'), ('pitch', 'f8')])
    return Published(
        messages['scan'],
        messages['points'],
        told['time'],
        told['stamp'],
        told['pitch'],
        [status for _, array in messages['diagnostics'] for status in array],
    )


def _taken(message: Any, topic: str, at_ns: int) -> Any:
    """Return of a message what counts."""
    if topic == 'scan':
        return scan_from_message(message)
    if topic == 'joint_states':
        return time_ns(message.header.stamp), float(message.position[0])
    if topic == 'points':
        data = message.data.view(POINT)
        xyz = np.stack([data[axis] for axis in 'xyz'], axis=1).astype(np.float64)
        return Cloud(time_ns(message.header.stamp), xyz)
    return [
        Status(at_ns, s.name, int(s.level), s.message, {v.key: v.value for v in s.values})
        for s in message.status
    ]


def codes_of(scan: Scan) -> NDArray[np.int64]:
    """Return a scan's ranges as the lidar sends them [mm], 0 where there is none."""
    finite = np.where(np.isfinite(scan.ranges), scan.ranges, 0.0)
    return np.asarray(np.rint(finite * 1e3), dtype=np.int64)


def sources(scans: list[tuple[int, Scan]], sent: list[TrueScan]) -> NDArray[np.intp]:
    """Return for each scan which of those that were sent it is, -1 if none, shape (n,).

    It is the one that it shares most of its ranges with, half of them at least, of those that
    were sent within a quarter of a minute before it was published. Stamps are not asked: they may
    be wrong.
    """
    found = np.full(len(scans), -1)
    if not sent:
        return found
    codes = np.stack([scan.codes for scan in sent])
    ends_ns = np.array([scan.times_ns[-1] for scan in sent])
    for i, (at_ns, scan) in enumerate(scans):
        first, end = np.searchsorted(ends_ns, [at_ns - 15_000_000_000, at_ns])
        if first < end and scan.ranges.size == codes.shape[1]:
            own = codes_of(scan)
            same = ((codes[first:end] == own) & (own > 0)).sum(axis=1)
            best = int(same.argmax())
            found[i] = first + best if same[best] > np.count_nonzero(own) / 2 else -1
    return found
