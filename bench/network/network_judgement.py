"""What became of the scans of a sensor whose assembler is on another machine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from nodlidar_assembler.clouds.point_layout import POINT, xyz_in
from nodlidar_assembler.inputs.scan_input import scan_from_message
from nodlidar_common.arrays import Array
from nodlidar_common.stamps import time_ns
import numpy as np
from numpy.typing import NDArray

from bench.faults.fault_errors import Errors, errors
from bench.faults.fault_log import Cloud, Published
from bench.faults.fault_truth import Truth
from bench.network.network_listener import Arrival

_GAPS = 'revolutions without a scan'
_LOST = 'lost before they arrived: scans'
_DROPPED = 'dropped: '


@dataclass(frozen=True, slots=True)
class Account:
    """The scans from that of the first cloud to that of the last one, and the clouds.

    Attributes
    ----------
    sent, clouds
        Scans that the driver published, and clouds that came.
    dropped
        Scans and joint states that the assembler dropped, by reason.
    lost, gaps
        Scans that the assembler counted as lost on the way, by the numbers of the messages and by
        their stamps.
    unaccounted
        Scans that are neither in a cloud nor in one of the assembler's counts.
    undecided
        Scans that the assembler received, by its own counts from its start on, and neither
        assembled nor dropped.
    strangers
        Clouds of no scan, and clouds that came twice.
    error
        RMS distance of the points of each cloud to their true positions [m].
    late
        Time from the last beam of each cloud's scan to the arrival of the cloud [s].
    """

    sent: int
    clouds: int
    dropped: dict[str, int]
    lost: int
    gaps: int
    unaccounted: int
    undecided: int
    strangers: int
    error: Array
    late: Array


def account(here: Iterable[Arrival], there: Iterable[Arrival], truth: Truth) -> Account:
    """Return what became of each scan.

    Parameters
    ----------
    here
        What arrived on the robot: all scans.
    there
        What arrived beside the assembler: its clouds and its diagnostics.
    truth
        What the devices truly did.
    """
    scans = [each for each in here if each.topic == 'scan']
    listed = list(there)
    clouds = [each for each in listed if each.topic == 'points']
    published = Published(
        sorted(((a.published_ns, scan_from_message(a.message())) for a in scans), key=_time),
        [(a.published_ns, _cloud(a.message())) for a in clouds],
        [],
    )
    found = errors(published, truth)
    span = _span(found)
    before, after = _counts_around(listed, clouds[0].arrived_ns)
    counted = {key: after[key] - before.get(key, 0) for key in after}
    dropped = {
        key.removeprefix(_DROPPED): count
        for key, count in counted.items()
        if key.startswith(_DROPPED) and count
    }
    lost, gaps = counted.get(_LOST, 0), counted.get(_GAPS, 0)
    known = found.scan_of_cloud[found.scan_of_cloud >= 0]
    in_clouds = np.unique(known).size
    return Account(
        sent=span.size,
        clouds=len(clouds),
        dropped=dropped,
        lost=lost,
        gaps=gaps,
        unaccounted=max(span.size - in_clouds - _scans_of(counted) - max(lost, gaps), 0),
        undecided=_undecided(after),
        strangers=len(clouds) - in_clouds,
        error=found.cloud,
        late=_late(clouds, found, truth),
    )


def are_decided(there: Iterable[Arrival]) -> bool:
    """Return whether the assembler reports that no scan comes, and what became of each."""
    counts: dict[str, int] = {}
    said = ''
    for status in map(_report_of, there):
        if status is not None:
            counts, said = _counts(status), status.message
    return 'no scan ' in said and _undecided(counts) == 0


def _undecided(counts: dict[str, int]) -> int:
    return counts['scans'] - counts['clouds'] - _scans_of(counts)


def _scans_of(counts: dict[str, int]) -> int:
    """Return how many scans were dropped: other drops are of joint states and transforms."""
    others = tuple(f'{_DROPPED}{what}' for what in ('joint state ', 'transform '))
    return sum(
        count
        for reason, count in counts.items()
        if reason.startswith(_DROPPED) and not reason.startswith(others)
    )


def _span(found: Errors) -> NDArray[np.intp]:
    known = found.scan_of_cloud[found.scan_of_cloud >= 0]
    return np.arange(known.min(), known.max() + 1)


def _late(clouds: list[Arrival], found: Errors, truth: Truth) -> Array:
    arrived = np.array([each.arrived_ns for each in clouds])
    ends_ns = np.array([int(scan.times_ns[-1]) for scan in truth.scans])
    known = found.scan_of_cloud >= 0
    source = found.source[found.scan_of_cloud[known]]
    return np.asarray((arrived[known] - ends_ns[source]) / 1e9)


def _counts_around(arrived: list[Arrival], first_ns: int) -> tuple[dict[str, int], dict[str, int]]:
    """Return the assembler's last counts before an instant [ns], and its last ones at all."""
    before: dict[str, int] = {}
    after: dict[str, int] = {}
    for each in arrived:
        if (status := _report_of(each)) is not None:
            after = _counts(status)
            before = after if each.arrived_ns < first_ns else before
    return before, after


def _report_of(arrived: Arrival) -> Any:
    """Return the assembler's status in a message of diagnostics; None if it has none."""
    listed = arrived.message().status if arrived.topic == '/diagnostics' else []
    return next((status for status in listed if status.name == 'assembler: clouds'), None)


def _counts(status: Any) -> dict[str, int]:
    return {v.key: int(v.value) for v in status.values if v.value.isdigit()}


def _cloud(message: Any) -> Cloud:
    data = np.frombuffer(bytes(message.data), dtype=POINT)
    return Cloud(time_ns(message.header.stamp), xyz_in(data))


def _time(entry: tuple[int, Any]) -> int:
    return entry[0]
