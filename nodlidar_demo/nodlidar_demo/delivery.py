"""Delivery of clouds as recorded in a bag: latency and drops; start of the simulation."""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_source import messages_of
from nodlidar_assembler.bags.bag_topics import BagError
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import NS_PER_S, time_ns
import numpy as np
from rosbags.highlevel import AnyReader

TOPICS = ('arrival', 'scan', 'points', 'diagnostics')


@dataclass(frozen=True, slots=True)
class Delivery:
    """Delivery of the clouds in a bag.

    Attributes
    ----------
    latency
        From a scan's last byte at the port, or with a third-party driver from its publication, to
        the publication of its cloud [s], shape (n,).
    dropped
        Drops that the nodes reported in their last diagnostics, counted by reason.
    clouds, points
        Numbers received.
    nods
        Commanded nods whose limits or N_s differ from the one before: lower and upper limit [rad]
        and N_s, shape (n, 3).
    """

    latency: Array
    dropped: Counter[str]
    clouds: int
    points: int
    nods: Array


def read_delivery(bag: Path, others: AssemblerConfig | None = None) -> Delivery:
    """Return the delivery of the clouds in a bag, one cloud per scan.

    Parameters
    ----------
    bag
        The bag.
    others
        Conventions of a third-party driver, such as the delay of its stamps; by default, the scans
        are of our driver, which publishes when their last byte arrived.

    Raises
    ------
    BagError
        If the bag cannot be read to its end.
    """
    scan_input = None if others is None else ScanInput(others)
    arrivals: dict[int, int] = {}
    clouds: list[tuple[int, int]] = []
    dropped: dict[str, Counter[str]] = {}
    points = 0
    for recorded in messages_of(bag, lambda topic, kind: _name(topic) in TOPICS):
        name, message = _name(recorded.topic), recorded.message
        if name == 'arrival':
            arrivals[time_ns(message.time_ref)] = time_ns(message.header.stamp)
        elif name == 'scan':
            if scan_input is not None:
                with suppress(RefusedScanError):  # which gives no cloud either
                    scan = scan_input.scan(message, recorded.time_ns)
                    arrivals[scan.stamp_ns] = recorded.time_ns
        elif name == 'points':
            clouds.append((time_ns(message.header.stamp), recorded.time_ns))
            points += message.width
        else:
            dropped |= {status.name: _drops_of(status) for status in message.status}
    return Delivery(
        _latency(arrivals, clouds),
        sum(dropped.values(), Counter()),
        len(clouds),
        points,
        read_nods(bag),
    )


def read_nods(bag: Path) -> Array:
    """Return the commanded nods in a bag, by the definition in it; see Delivery."""
    nods: list[tuple[float, float, float]] = []
    with AnyReader([bag]) as reader:
        topics = [each for each in reader.connections if _name(each.topic) == 'nod_command']
        for topic, _, data in reader.messages(topics) if topics else ():
            message: Any = reader.deserialize(data, topic.msgtype)
            nod = message.pitch_min, message.pitch_max, float(message.samples_per_sweep)
            if not nods or nod != nods[-1]:
                nods.append(nod)
    return np.array(nods, dtype=np.float64).reshape(-1, 3)


def _name(topic: str) -> str:
    """Return a topic without its namespace."""
    return topic.rsplit('/', 1)[-1]


def _drops_of(status: Any) -> Counter[str]:
    """Return the positive counts under the keys 'dropped: reason' of a diagnostic status."""
    found = {v.key: v.value for v in status.values if v.key.startswith('dropped: ')}
    return +Counter({key.removeprefix('dropped: '): int(n) for key, n in found.items()})


def _latency(arrivals: dict[int, int], clouds: list[tuple[int, int]]) -> Array:
    """Pair each cloud with the last scan whose first beam is not after its first point."""
    scans = np.array(sorted(arrivals), dtype=np.int64)
    stamps, published = np.array(clouds, dtype=np.int64).reshape(-1, 2).T
    scan = np.searchsorted(scans, stamps, side='right') - 1
    last_byte = np.array([arrivals[int(s)] for s in scans[scan[scan >= 0]]], dtype=np.int64)
    return np.asarray((published[scan >= 0] - last_byte) / NS_PER_S, dtype=np.float64)


def read_start_ns(bag: Path) -> int:
    """Return when base and people started to move [ns], as published by the simulation.

    Raises
    ------
    BagError
        If it was not published.
    """
    for recorded in messages_of(bag, lambda topic, kind: topic.endswith('/base/start')):
        return time_ns(recorded.message.header.stamp)
    raise BagError(f"'{bag}' lacks the start of the simulation, /base/start")
