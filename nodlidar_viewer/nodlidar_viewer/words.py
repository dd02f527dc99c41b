"""The texts of the page."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
import re

LEVELS = ('OK', 'WARNING', 'ERROR', 'STALE')
SILENT = 4  # seconds after which a status counts as stale


@dataclass(frozen=True, slots=True)
class Status:
    """A diagnostic status.

    Attributes
    ----------
    name
        Node and task, such as ``assembler: clouds``.
    level
        0 OK, 1 warning, 2 error, 3 stale.
    message
        In words.
    heard
        When it was heard [s].
    """

    name: str
    level: int
    message: str
    heard: float


def plain(text: str) -> str:
    """Return a text from elsewhere as one line of Markdown that shows it as it is.

    viser makes HTML in Markdown a part of the page, scripts included.
    """
    return re.sub(r'([\\`*_\[\]<>&~|])', r'\\\1', ' '.join(text.split()))


def diagnostics(statuses: Iterable[Status], now: float) -> str:
    """Return statuses as Markdown; those not heard for SILENT seconds are marked."""
    lines = []
    for status in sorted(statuses, key=lambda status: status.name):
        age, name = now - status.heard, plain(status.name)
        if age > SILENT:
            lines.append(f'**{name}**: {LEVELS[3]}, nothing heard for {age:.0f} s')
        else:
            lines.append(f'**{name}**: {_level(status.level)}{plain(status.message)}')
    return '\n\n'.join(lines) or 'no diagnostics yet'


def _level(level: int) -> str:
    return f'{LEVELS[min(level, 3)]}, ' if level else ''


def rates(counts: Mapping[str, int], seconds: float) -> str:
    """Return how often messages came, by topic, as Markdown."""
    rows = [f'| {topic} | {count / seconds:.1f} |' for topic, count in counts.items()]
    return '\n'.join(['| topic | per second |', '| --- | --- |', *rows])


def coverage(seen: float, hole: float, window: float, cell: float) -> str:
    """Return observed coverage in words: share of cells seen, angles [rad], time [s]."""
    size = f'{math.degrees(cell):.1f}°'
    if hole <= 0.0:
        return f'**{seen:.1%}** of the cells of {size} seen in {window:.0f} s, no hole'
    return (
        f'**{seen:.1%}** of the cells of {size} seen in {window:.0f} s; largest hole '
        f'{math.degrees(hole):.1f}°'
    )
