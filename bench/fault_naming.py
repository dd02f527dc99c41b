"""How diagnostics name a fault: by a complaint, by a figure that rises, or by staying away."""

from __future__ import annotations

import math
import re

import numpy as np

from bench.fault_log import Status

_SILENT = 1.5  # diagnostics that are late by so many of their periods are missing
_NUMBER = re.compile(r'[-+]?\d[\d.]*')


class Naming:
    """Knows all diagnostics.

    Parameters
    ----------
    statuses
        In the order of their times.
    healthy_ns
        From when to when nothing was wrong [ns]: counts that rise then are no complaint.
    """

    def __init__(self, statuses: list[Status], healthy_ns: tuple[int, int]) -> None:
        self._statuses = statuses
        self._restless = _restless_keys(
            [s for s in statuses if healthy_ns[0] <= s.time_ns < healthy_ns[1]]
        )

    def after(self, onset_ns: int, until_ns: int) -> tuple[float, str, float]:
        """Return how long after its onset a fault was named, how, and when it was counted [s].

        Both times are infinite where that did not happen before an end [ns].
        """
        before = {s.name: s for s in self._statuses if s.time_ns < onset_ns}
        during = [s for s in self._statuses if onset_ns <= s.time_ns <= until_ns]
        complaints = [
            (status.time_ns, f'{status.name}: {status.message}')
            for status in during
            if _is_new_complaint(status, before.get(status.name))
        ]
        complaints += self._silences(before, onset_ns, until_ns)
        named_ns, text = min(complaints, default=(math.inf, ''))
        risen = [s for s in during if _risen(before.get(s.name), s) - self._restless]
        counted_ns = min((s.time_ns for s in risen), default=math.inf)
        return (named_ns - onset_ns) / 1e9, text, (counted_ns - onset_ns) / 1e9

    def _silences(
        self, before: dict[str, Status], onset_ns: int, until_ns: int
    ) -> list[tuple[int, str]]:
        """Return when [ns] a node's diagnostics were found missing, and whose."""
        found = []
        for name, last in before.items():
            times = [s.time_ns for s in self._statuses if s.name == name]
            period_ns = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
            due_ns = last.time_ns + _SILENT * period_ns
            following = min((t for t in times if t >= onset_ns), default=math.inf)
            if onset_ns <= due_ns < min(following, until_ns):
                found.append((round(due_ns), f'{name}: nothing more comes'))
        return found


def counts_of(values: dict[str, str]) -> dict[str, int]:
    """Return the whole numbers among the values of a status."""
    return {key: int(value) for key, value in values.items() if value.isdigit()}


def _is_new_complaint(status: Status, last: Status | None) -> bool:
    """Tell whether something is wrong that was not, figures apart."""
    known = '' if last is None or not last.level else _NUMBER.sub('', last.message)
    return status.level > 0 and _NUMBER.sub('', status.message) != known


def _risen(last: Status | None, status: Status) -> set[str]:
    before = {} if last is None else counts_of(last.values)
    return {key for key, n in counts_of(status.values).items() if n > before.get(key, 0)}


def _restless_keys(statuses: list[Status]) -> set[str]:
    """Return the counts that change although nothing is wrong."""
    seen: dict[tuple[str, str], set[int]] = {}
    for status in statuses:
        for key, n in counts_of(status.values).items():
            seen.setdefault((status.name, key), set()).add(n)
    return {key for (_, key), numbers in seen.items() if len(numbers) > 1}
