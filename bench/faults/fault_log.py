"""What a sensor published, from its bag: scans, clouds, diagnostics."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.clouds.point_layout import POINT, xyz_in
from nodlidar_assembler.inputs.scan_input import scan_from_message
from nodlidar_common.arrays import Array, Integers
from nodlidar_common.stamps import time_ns
import numpy as np
from numpy.typing import NDArray

from bench.faults.fault_truth import TrueScan

TOPICS = ('scan', 'points', 'diagnostics')


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """A cloud: its stamp [ns] and points [m], shape (n, 3)."""

    stamp_ns: int
    xyz: Array


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
    """What was published.

    Attributes
    ----------
    scans, clouds
        With the times at which they were published [ns], ascending.
    statuses
        In the order of their times.
    """

    scans: list[tuple[int, Scan]]
    clouds: list[tuple[int, Cloud]]
    statuses: list[Status]


def read_published(bag: Path) -> Published:
    """Return the messages of a bag; raises BagError if it cannot be read to its end."""
    messages: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in TOPICS}
    for recorded in messages_of(bag, lambda topic, kind: topic.lstrip('/') in TOPICS):
        message = _taken(recorded.message, recorded.topic.lstrip('/'), recorded.time_ns)
        messages[recorded.topic.lstrip('/')].append((recorded.time_ns, message))
    for each in messages.values():
        each.sort(key=lambda entry: entry[0])
    return Published(
        messages['scan'],
        messages['points'],
        [status for _, array in messages['diagnostics'] for status in array],
    )


def _taken(message: Any, topic: str, at_ns: int) -> Any:
    """Return the part of a message that is judged."""
    if topic == 'scan':
        return scan_from_message(message)
    if topic == 'points':
        return Cloud(time_ns(message.header.stamp), xyz_in(message.data.view(POINT)))
    return [
        Status(at_ns, s.name, int(s.level), s.message, {v.key: v.value for v in s.values})
        for s in message.status
    ]


def codes_of(scan: Scan) -> Integers:
    """Return a scan's ranges as the lidar sends them [mm], 0 where there is none."""
    finite = np.where(np.isfinite(scan.ranges), scan.ranges, 0.0)
    return np.asarray(np.rint(finite * 1e3), dtype=np.int64)


def sources(scans: list[tuple[int, Scan]], sent: list[TrueScan]) -> NDArray[np.intp]:
    """Return the number of the sent scan that each scan is, -1 if none, shape (n,).

    Of the scans sent in the 15 s before it was published, it is the one with the most equal
    ranges, at least half of them. Stamps are not used: they may be wrong.
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
