"""What happens in a launch."""

from dataclasses import dataclass
from typing import Any

from underlay_refusal import Partial


@dataclass(frozen=True)
class ProcessStarted(Partial):
    """The start of the process of an action."""

    action: Any
    process_name: str
    cmd: list[str]
    pid: int


@dataclass(frozen=True)
class ProcessExited(Partial):
    """The end of a process; a negative returncode is the signal that ended it."""

    process_name: str
    cmd: list[str]
    pid: int
    returncode: int


class Shutdown(Partial):
    """The begin of the shutdown."""
