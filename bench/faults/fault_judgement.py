"""The judgement of each fault: whether it was named and healed, and its errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
import re

from nodlidar_common.arrays import Array, Mask, Times
import numpy as np

from bench.faults.fault_errors import Errors
from bench.faults.fault_log import Published
from bench.faults.fault_naming import named
from bench.faults.fault_recorder import HEALTHY_SHARE, SCAN_RATE
from bench.faults.fault_truth import Truth

CLOUD_LIMIT, STAMP_LIMIT = 0.010, 0.002  # [m], [s]
WINDOW_NS = 1_000_000_000  # over which the rate of clouds is taken
_NAMED_LATE_NS = 3_000_000_000  # after its end a fault may still be named
_LOSSES = {
    'driver': re.compile(r'Scans (missed|dropped)'),
    'assembler': re.compile(r'(dropped: |lost before they arrived: scans)'),
}


@dataclass(frozen=True, slots=True)
class Episode:
    """A fault, and the time after it until the next one.

    Attributes
    ----------
    kind, detail
        The kind of fault, and its size.
    onset_ns, end_ns
        When it began to have an effect and when it ended [ns]; onset_ns is None if it had none.
    mended_ns
        When the recovery can begin: end_ns or, if the launch ended, its new start [ns].
    began_ns, until_ns
        The time that is judged [ns].
    relaunched
        Whether the launch ended and was started again; the laser has to go off then.
    releases
        Whether torque has to go off.
    """

    kind: str
    detail: str
    onset_ns: int | None
    end_ns: int
    mended_ns: int
    began_ns: int
    until_ns: int
    relaunched: bool = False
    releases: bool = False


@dataclass(frozen=True, slots=True)
class Judgement:
    """The judgement of a fault; times in s, NaN where there was nothing to judge.

    Attributes
    ----------
    named, text
        Time from its onset until diagnostics warned of it, or stayed away, and how; infinite if
        neither.
    healed
        Time from mended_ns until clouds came at their rate again; infinite if they did not.
    cloud, stamp
        Worst errors [m], [s].
    clouds_off, stamps_off
        Clouds that are more than CLOUD_LIMIT worse than any of the healthy system, and scans whose
        stamps are more than STAMP_LIMIT off.
    changed
        Beams that were published with a range that the lidar did not send.
    missing
        Scans that were sent to a host and not published in a cloud.
    unaccounted
        Scans that were sent to a host and neither published nor counted as lost, and scans that
        were published and neither in a cloud nor counted.
    torque_off, laser_off
        Time from its onset until they went off; infinite if not before its end.
    """

    named: float
    text: str
    healed: float
    cloud: float
    stamp: float
    clouds_off: int
    stamps_off: int
    changed: int
    missing: int
    unaccounted: int
    torque_off: float
    laser_off: float


class Judge:
    """Judges faults by what was published and by the truth.

    Parameters
    ----------
    published, truth, found
        What was published, what truly happened, and the errors.
    healthy_ns
        Begin and end of the time without faults [ns].
    launches_ns
        When the nodes were started [ns], ascending: their counts begin at 0.
    """

    def __init__(
        self,
        published: Published,
        truth: Truth,
        found: Errors,
        healthy_ns: tuple[int, int],
        launches_ns: Sequence[int],
    ) -> None:
        self._launches_ns = launches_ns
        self._published, self._truth, self._found = published, truth, found
        self._scan_ns = np.array([t for t, _ in published.scans], dtype=np.int64)
        self._cloud_ns = np.array([t for t, _ in published.clouds], dtype=np.int64)
        self._sent_ns = np.array([s.times_ns[-1] for s in truth.scans], dtype=np.int64)
        self._heard = np.array([s.heard for s in truth.scans], dtype=bool)
        healthy = _worst(found.cloud[_within(self._cloud_ns, healthy_ns)])
        self._cloud_limit = CLOUD_LIMIT + healthy

    def judge(self, episode: Episode) -> Judgement:
        """Return the judgement of a fault."""
        found, span_ns = self._found, (episode.began_ns, episode.until_ns)
        scans, clouds = _within(self._scan_ns, span_ns), _within(self._cloud_ns, span_ns)
        named_after, text = math.nan, ''
        if episode.onset_ns is not None and not episode.relaunched:
            until_ns = min(episode.end_ns + _NAMED_LATE_NS, episode.until_ns)
            named_after, text = named(self._published.statuses, episode.onset_ns, until_ns)
        missing, unaccounted = self._accounted(episode)
        truth, onset_ns = self._truth, episode.onset_ns or episode.began_ns
        torque_off = laser_off = math.nan
        if episode.releases:
            torque_off = truth.torque.off_after(onset_ns, episode.end_ns)
        if episode.relaunched:
            laser_off = truth.laser.off_after(onset_ns, episode.end_ns)
        return Judgement(
            named=named_after,
            text=text,
            healed=self._healed(episode),
            cloud=_worst(found.cloud[clouds]),
            stamp=_worst(found.stamp[scans]),
            clouds_off=int((found.cloud[clouds] > self._cloud_limit).sum()),
            stamps_off=int((np.abs(found.stamp[scans]) > STAMP_LIMIT).sum()),
            changed=int(found.changed[scans].sum()),
            missing=missing,
            unaccounted=unaccounted,
            torque_off=torque_off,
            laser_off=laser_off,
        )

    def _healed(self, episode: Episode) -> float:
        """Return when clouds came at their rate again, for WINDOW_NS at least."""
        enough = math.ceil(HEALTHY_SHARE * SCAN_RATE * WINDOW_NS / 1e9)
        after = self._cloud_ns[self._cloud_ns >= episode.mended_ns]
        for start_ns in (episode.mended_ns, *after):
            if start_ns + WINDOW_NS > episode.until_ns:
                break
            if np.count_nonzero(_within(after, (start_ns, start_ns + WINDOW_NS))) >= enough:
                return float(start_ns - episode.mended_ns) / 1e9
        return math.inf

    def unaccounted(self, episodes: Sequence[Episode]) -> int:
        """Return the number of unaccounted scans, over all faults of each launch together.

        A loss at the end of a fault may be counted after it, which makes no difference here.
        """
        launches: list[list[Episode]] = []
        for episode in episodes:
            if episode.relaunched or not launches:
                launches.append([])
            launches[-1].append(episode)
        wholes = [replace(each[0], until_ns=each[-1].until_ns) for each in launches]
        return sum(self._accounted(whole)[1] for whole in wholes)

    def _accounted(self, episode: Episode) -> tuple[int, int]:
        """Return the numbers of missing and of unaccounted scans."""
        span_ns = episode.began_ns, episode.until_ns
        if episode.relaunched:  # a node that ended cannot count its losses
            later = self._scan_ns[self._scan_ns > episode.mended_ns]
            span_ns = (int(later[0]) if later.size else span_ns[1]), span_ns[1]
        sent = np.flatnonzero(_within(self._sent_ns, span_ns) & self._heard)
        published = np.flatnonzero(np.isin(self._found.source, sent))
        in_clouds = np.count_nonzero(np.isin(self._found.scan_of_cloud, published))
        lost = {'driver': sent.size - published.size, 'assembler': published.size - in_clouds}
        counted = {node: self._counted(node, episode) for node in lost}
        return sent.size - in_clouds, sum(max(lost[n] - counted[n], 0) for n in lost)

    def _counted(self, node: str, episode: Episode) -> int:
        """Return how many scans a node counted as lost."""
        started_ns = max((t for t in self._launches_ns if t <= episode.until_ns), default=0)
        before = self._losses(node, started_ns, episode.began_ns)
        now = self._losses(node, started_ns, episode.until_ns)
        return sum(max(n - before.get(key, 0), 0) for key, n in now.items())

    def _losses(self, node: str, started_ns: int, until_ns: int) -> dict[str, int]:
        """Return the last counts of losses that a node published from its start to a time [ns]."""
        found: dict[str, int] = {}
        for status in self._published.statuses:
            if node in status.name and started_ns <= status.time_ns < until_ns:
                found |= {key: int(n) for key, n in status.values.items() if n.isdigit()}
        return {key: n for key, n in found.items() if _LOSSES[node].match(key)}


def _within(times_ns: Times, span_ns: tuple[int, int]) -> Mask:
    return np.asarray((times_ns >= span_ns[0]) & (times_ns < span_ns[1]))


def _worst(errors: Array) -> float:
    known = np.abs(errors[~np.isnan(errors)])
    return float(known.max()) if known.size else math.nan
