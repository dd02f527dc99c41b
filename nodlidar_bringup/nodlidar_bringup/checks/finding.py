"""What a check found."""

from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """How bad it is."""

    GOOD = 0
    UNKNOWN = 1
    WARNING = 2
    FAULT = 3


@dataclass(frozen=True, slots=True)
class Finding:
    """One result of a check.

    Attributes
    ----------
    level
        How bad it is.
    check
        Short name of what was found, the same for every instance of it.
    text
        What was found, in a sentence.
    remedy
        What fixes it, a command where there is one; empty if nothing is wrong.
    """

    level: Level
    check: str
    text: str
    remedy: str = ''


def good(check: str, text: str) -> Finding:
    """Return a finding that all is well."""
    return Finding(Level.GOOD, check, text)


def unknown(check: str, text: str, remedy: str = '') -> Finding:
    """Return a finding that something could not be checked."""
    return Finding(Level.UNKNOWN, check, text, remedy)


def warning(check: str, text: str, remedy: str) -> Finding:
    """Return a finding of something that may do harm."""
    return Finding(Level.WARNING, check, text, remedy)


def fault(check: str, text: str, remedy: str) -> Finding:
    """Return a finding of something that is wrong."""
    return Finding(Level.FAULT, check, text, remedy)
