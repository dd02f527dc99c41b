"""How diagnostics name a fault: by a complaint, or by staying away."""

from collections.abc import Iterator, Sequence
import math
import re

import numpy as np

from bench.faults.fault_log import Status

_SILENT = 1.5  # diagnostics that are late by this many of their periods are missing
_NUMBER = re.compile(r'[-+]?\d[\d.]*')


def named(statuses: Sequence[Status], onset_ns: int, until_ns: int) -> tuple[float, str]:
    """Return how long after its onset a fault was named [s], infinite if it was not, and how.

    Parameters
    ----------
    statuses
        All diagnostics, in the order of their times.
    onset_ns, until_ns
        Onset of the fault, and the end of the time in which it can be named [ns].
    """
    before = {s.name: s for s in statuses if s.time_ns < onset_ns}
    complaints = [
        (status.time_ns, f'{status.name}: {status.message}')
        for status in statuses
        if onset_ns <= status.time_ns <= until_ns
        and _is_new_complaint(status, before.get(status.name))
    ]
    complaints += _silences(statuses, before, onset_ns, until_ns)
    named_ns, text = min(complaints, default=(math.inf, ''))
    return (named_ns - onset_ns) / 1e9, text


def _silences(
    statuses: Sequence[Status], before: dict[str, Status], onset_ns: int, until_ns: int
) -> Iterator[tuple[int, str]]:
    """Yield when the diagnostics of a node were found missing [ns], and of which node."""
    for name, last in before.items():
        times = [s.time_ns for s in statuses if s.name == name]
        period_ns = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
        due_ns = last.time_ns + _SILENT * period_ns
        following = min((t for t in times if t >= onset_ns), default=math.inf)
        if onset_ns <= due_ns < min(following, until_ns):
            yield round(due_ns), f'{name}: nothing more comes'


def _is_new_complaint(status: Status, last: Status | None) -> bool:
    """Return whether a status complains in other words than the last one; numbers do not count."""
    known = '' if last is None or not last.level else _NUMBER.sub('', last.message)
    return status.level > 0 and _NUMBER.sub('', status.message) != known
