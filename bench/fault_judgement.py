"""What became of each fault: was it named, did it heal, what did it spoil."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
import re

import numpy as np
from numpy.typing import NDArray

from bench.fault_errors import Errors
from bench.fault_log import Published
from bench.fault_naming import counts_of, Naming
from bench.fault_recorder import HEALTHY_SHARE, SCAN_RATE
from bench.fault_truth import Truth

CLOUD_LIMIT, STAMP_LIMIT = 0.010, 0.002  # [m], [s]
WINDOW_NS = 1_000_000_000  # over which the rate of clouds is taken
_TOLD_NS = 3_000_000_000  # after its end a fault may still be named
_LOSSES = {'driver': re.compile(r'Scans (missed|dropped)'), 'assembler': re.compile('dropped: ')}


@dataclass(frozen=True, slots=True)
class Episode:
    """A fault, and the time after it until the next one.

    Attributes
    ----------
    kind, detail
        Which fault, and how bad.
    onset_ns, end_ns
        From when to when it lasted [ns]; onset_ns is None if nothing was hit.
    mended_ns
        From when on all can be well again: end_ns or, if the launch ended, its new start [ns].
    began_ns, until_ns
        The time that is its [ns].
    relaunched
        Whether the launch ended and was started again.
    releases
        Whether torque had to go off; the laser has to where the launch ended.
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
    """What became of a fault; times in s, NaN where there was nothing to judge.

    Attributes
    ----------
    named, text
        How long after its onset diagnostics warned of it, or stayed away, and how; infinite if
        neither.
    counted
        How long after its onset a figure of the diagnostics rose that counts what goes wrong;
        infinite if none did.
    healed
        How long after it was mended clouds came at their rate again; infinite if they did not.
    cloud, stamp, joint
        Worst errors [m], [s], [rad].
    clouds_off, stamps_off
        Clouds that are more than CLOUD_LIMIT worse than any while nothing was wrong, and scans
        whose stamps are more than STAMP_LIMIT wrong.
    changed
        Beams that were published with a range that the lidar did not send.
    missing
        Scans that were sent to a host and made no cloud.
    unaccounted
        Scans that were sent to a host and neither published nor counted as lost, and those that
        were published and made no cloud nor were counted.
    torque_off, laser_off
        How long after its onset they went off; infinite if not before its end.
    """

    named: float
    text: str
    counted: float
    healed: float
    cloud: float
    stamp: float
    joint: float
    clouds_off: int
    stamps_off: int
    changed: int
    missing: int
    unaccounted: int
    torque_off: float
    laser_off: float


class Judge:
    """Knows all that was published and all that is true.

    Parameters
    ----------
    published, truth, found
        What was published, what really happened, and how far off the one is from the other.
    healthy_ns
        From when to when nothing was wrong [ns].
    launches_ns
        When the nodes were started [ns], ascending: they count from 0.
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
        self._naming = Naming(published.statuses, healthy_ns)

    def judge(self, episode: Episode) -> Judgement:
        """Return what became of a fault."""
        found, span_ns = self._found, (episode.began_ns, episode.until_ns)
        scans, clouds = _within(self._scan_ns, span_ns), _within(self._cloud_ns, span_ns)
        joints = _within(self._published.joint_ns, span_ns)
        named, text, counted = math.nan, '', math.nan
        if episode.onset_ns is not None and not episode.relaunched:
            until_ns = min(episode.end_ns + _TOLD_NS, episode.until_ns)
            named, text, counted = self._naming.after(episode.onset_ns, until_ns)
        missing, unaccounted = self._accounted(episode)
        truth, onset_ns = self._truth, episode.onset_ns or episode.began_ns
        torque_off = laser_off = math.nan
        if episode.releases:
            torque_off = truth.torque.off_after(onset_ns, episode.end_ns)
        if episode.relaunched:
            laser_off = truth.laser.off_after(onset_ns, episode.end_ns)
        return Judgement(
            named=named,
            text=text,
            counted=counted,
            healed=self._healed(episode),
            cloud=_worst(found.cloud[clouds]),
            stamp=_worst(found.stamp[scans]),
            joint=_worst(found.joint[joints]),
            clouds_off=int((found.cloud[clouds] > self._cloud_limit).sum()),
            stamps_off=int((np.abs(found.stamp[scans]) > STAMP_LIMIT).sum()),
            changed=int(found.changed[scans].sum()),
            missing=missing,
            unaccounted=unaccounted,
            torque_off=torque_off,
            laser_off=laser_off,
        )

    def _healed(self, episode: Episode) -> float:
        """Return when clouds came at their rate again, for WINDOW_NS from then on."""
        enough = math.ceil(HEALTHY_SHARE * SCAN_RATE * WINDOW_NS / 1e9)
        after = self._cloud_ns[self._cloud_ns >= episode.mended_ns]
        for start_ns in (episode.mended_ns, *after):
            if start_ns + WINDOW_NS > episode.until_ns:
                break
            if np.count_nonzero(_within(after, (start_ns, start_ns + WINDOW_NS))) >= enough:
                return float(start_ns - episode.mended_ns) / 1e9
        return math.inf

    def unaccounted(self, episodes: Sequence[Episode]) -> int:
        """Return of how many scans nobody told from the first fault to the last one of a launch.

        What is lost at the end of a fault may be told of after it, which does not matter here.
        """
        launches: list[list[Episode]] = []
        for episode in episodes:
            if episode.relaunched or not launches:
                launches.append([])
            launches[-1].append(episode)
        wholes = [replace(each[0], until_ns=each[-1].until_ns) for each in launches]
        return sum(self._accounted(whole)[1] for whole in wholes)

    def _accounted(self, episode: Episode) -> tuple[int, int]:
        """Return how many scans that were sent made no cloud, and of how many nobody told."""
        span_ns = episode.began_ns, episode.until_ns
        if episode.relaunched:  # what is lost with a node, it cannot count
            later = self._scan_ns[self._scan_ns > episode.mended_ns]
            span_ns = (int(later[0]) if later.size else span_ns[1]), span_ns[1]
        sent = np.flatnonzero(_within(self._sent_ns, span_ns) & self._heard)
        published = np.flatnonzero(np.isin(self._found.source, sent))
        in_clouds = np.count_nonzero(np.isin(self._found.scan_of_cloud, published))
        lost = {'driver': sent.size - published.size, 'assembler': published.size - in_clouds}
        told = {node: self._counted(node, episode) for node in lost}
        return sent.size - in_clouds, sum(max(lost[n] - told[n], 0) for n in lost)

    def _counted(self, node: str, episode: Episode) -> int:
        """Return how many scans a node has counted as lost."""
        started_ns = max((t for t in self._launches_ns if t <= episode.until_ns), default=0)
        before = self._losses(node, started_ns, episode.began_ns)
        now = self._losses(node, started_ns, episode.until_ns)
        return sum(max(n - before.get(key, 0), 0) for key, n in now.items())

    def _losses(self, node: str, started_ns: int, until_ns: int) -> dict[str, int]:
        """Return what a node has last told of its losses from its start to a time [ns]."""
        found: dict[str, int] = {}
        for status in self._published.statuses:
            if node in status.name and started_ns <= status.time_ns < until_ns:
                found |= counts_of(status.values)
        return {key: n for key, n in found.items() if _LOSSES[node].match(key)}


def _within(times_ns: NDArray[np.int64], span_ns: tuple[int, int]) -> NDArray[np.bool_]:
    return np.asarray((times_ns >= span_ns[0]) & (times_ns < span_ns[1]))


def _worst(errors: NDArray[np.float64]) -> float:
    known = np.abs(errors[~np.isnan(errors)])
    return float(known.max()) if known.size else math.nan
