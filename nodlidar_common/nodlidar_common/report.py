"""What a device reports about itself."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Report:
    """Figures by name, and what is out of order, in words."""

    figures: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()


class Reporter(Protocol):
    """Reports about a device, at times [ns] of the steady clock."""

    def urgent(self, now_ns: int, /) -> object:
        """Return a value of which every change is published at once."""

    def next_report(self, now_ns: int, /) -> Report:
        """Return the state and what happened since the last report."""
