"""What became of each fault: was it named, did it heal, what did it spoil."""

from __future__ import annotations

from dataclasses import dataclass
import math
import re

import numpy as np
from numpy.typing import NDArray

from bench.fault_errors import Errors
from bench.fault_log import Published, Status
from bench.fault_recorder import HEALTHY_SHARE, SCAN_RATE
from bench.fault_truth import Truth

WINDOW_NS = 1_000_000_000  # over which the rate of clouds is taken
_TOLD_NS = 3_000_000_000  # after its end a fault may still be named
_SILENT = 1.5  # diagnostics that are late by so many of their periods are missing
_NUMBER = re.compile(r'[-+]?\d[\d.]*')
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
        Whether torque and laser had to go off.
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
        From when to when nothing was wrong [ns]: what diagnostics count then is no complaint.
    """

    def __init__(
        self, published: Published, truth: Truth, found: Errors, healthy_ns: tuple[int, int]
    ) -> None:
        self._published, self._truth, self._found = published, truth, found
        self._scan_ns = np.array([t for t, _ in published.scans], dtype=np.int64)
        self._cloud_ns = np.array([t for t, _ in published.clouds], dtype=np.int64)
        self._sent_ns = np.array([s.times_ns[-1] for s in truth.scans], dtype=np.int64)
        self._heard = np.array([s.heard for s in truth.scans], dtype=bool)
        self._restless = _restless_keys(
            [s for s in published.statuses if healthy_ns[0] <= s.time_ns < healthy_ns[1]]
        )

    def judge(self, episode: Episode) -> Judgement:
        """Return what became of a fault."""
        found, span_ns = self._found, (episode.began_ns, episode.until_ns)
        scans, clouds = _within(self._scan_ns, span_ns), _within(self._cloud_ns, span_ns)
        joints = _within(self._published.joint_ns, span_ns)
        named, text, counted = self._told(episode)
        missing, unaccounted = self._accounted(episode)
        truth, onset_ns = self._truth, episode.onset_ns or episode.began_ns
        off = [c.off_after(onset_ns, episode.end_ns) for c in (truth.torque, truth.laser)]
        torque_off, laser_off = off if episode.releases else (math.nan, math.nan)
        return Judgement(
            named=named,
            text=text,
            counted=counted,
            healed=self._healed(episode),
            cloud=_worst(found.cloud[clouds]),
            stamp=_worst(found.stamp[scans]),
            joint=_worst(found.joint[joints]),
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

    def _told(self, episode: Episode) -> tuple[float, str, float]:
        """Return how long after its onset a fault was named, how, and when it was counted."""
        if episode.onset_ns is None or episode.relaunched:
            return math.nan, '', math.nan
        onset_ns = episode.onset_ns
        until_ns = min(episode.end_ns + _TOLD_NS, episode.until_ns)
        statuses = self._published.statuses
        before = {s.name: s for s in statuses if s.time_ns < onset_ns}
        during = [s for s in statuses if onset_ns <= s.time_ns <= until_ns]
        complaints = [
            (status.time_ns, f'{status.name}: {status.message}')
            for status in during
            if _is_new_complaint(status, before.get(status.name))
        ]
        complaints += _silences(statuses, before, onset_ns, until_ns)
        named_ns, text = min(complaints, default=(math.inf, ''))
        risen = [s for s in during if _risen(before.get(s.name), s) - self._restless]
        counted_ns = min((s.time_ns for s in risen), default=math.inf)
        return (named_ns - onset_ns) / 1e9, text, (counted_ns - onset_ns) / 1e9

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
        """Return how many scans a node has counted as lost.

        The driver counts as missed those, too, that it has counted as dropped.
        """
        sums = []
        for time_ns in (episode.began_ns, episode.until_ns):
            last = [s for s in self._published.statuses if node in s.name and s.time_ns < time_ns]
            sums.append(_losses(last[-1].values, _LOSSES[node]) if last else {})
        before = {} if episode.relaunched else sums[0]
        more = {key: n - before.get(key, 0) for key, n in sums[1].items()}
        missed = sum(n for key, n in more.items() if 'missed' in key)
        return max(missed, sum(more.values()) - missed)


def _within(times_ns: NDArray[np.int64], span_ns: tuple[int, int]) -> NDArray[np.bool_]:
    return np.asarray((times_ns >= span_ns[0]) & (times_ns < span_ns[1]))


def _worst(errors: NDArray[np.float64]) -> float:
    known = np.abs(errors[~np.isnan(errors)])
    return float(known.max()) if known.size else math.nan


def _counts(values: dict[str, str]) -> dict[str, int]:
    """Return the whole numbers among the values of a status."""
    return {key: int(value) for key, value in values.items() if value.isdigit()}


def _losses(values: dict[str, str], keys: re.Pattern[str]) -> dict[str, int]:
    return {key: n for key, n in _counts(values).items() if keys.match(key)}


def _is_new_complaint(status: Status, last: Status | None) -> bool:
    """Tell whether something is wrong that was not, figures apart."""
    known = '' if last is None or not last.level else _NUMBER.sub('', last.message)
    return status.level > 0 and _NUMBER.sub('', status.message) != known


def _risen(last: Status | None, status: Status) -> set[str]:
    before = {} if last is None else _counts(last.values)
    return {key for key, n in _counts(status.values).items() if n > before.get(key, 0)}


def _restless_keys(statuses: list[Status]) -> set[str]:
    """Return the counts that change although nothing is wrong."""
    seen: dict[tuple[str, str], set[int]] = {}
    for status in statuses:
        for key, n in _counts(status.values).items():
            seen.setdefault((status.name, key), set()).add(n)
    return {key for (_, key), numbers in seen.items() if len(numbers) > 1}


def _silences(
    statuses: list[Status], before: dict[str, Status], onset_ns: int, until_ns: int
) -> list[tuple[int, str]]:
    """Return when [ns] a node's diagnostics were found missing, and whose."""
    found = []
    for name, last in before.items():
        times = [s.time_ns for s in statuses if s.name == name]
        period_ns = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
        due_ns = last.time_ns + _SILENT * period_ns
        following = min((t for t in times if t >= onset_ns), default=math.inf)
        if onset_ns <= due_ns < min(following, until_ns):
            found.append((round(due_ns), f'{name}: nothing more comes'))
    return found
