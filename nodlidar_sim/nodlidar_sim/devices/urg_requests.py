"""Commands and replies of SCIP 2.0 as bytes, as the emulated URG-04LX reads and writes them.

Section numbers are those of Hokuyo's specification C-42-03320B.
"""

from dataclasses import dataclass
import re

from nodlidar_common import scip
from nodlidar_sim.devices.urg_scan import ScanRequest

MAX_LINE = 80

_TEXT = re.compile(rb'[A-Za-z0-9 ._+@]*')
_MAX_TEXT = 16


class CommandError(Exception):
    """Refuses a command: the sensor answers with an error status and does nothing else."""

    def __init__(self, status: bytes) -> None:
        super().__init__(status)
        self.status = status


@dataclass(slots=True)
class Stream:
    """A running MD or MS.

    Attributes
    ----------
    request
        What each message carries.
    head, tail
        The echo before and after the count of remaining scans.
    interval
        Turns between two messages.
    remaining
        Scans still to send; None for endless.
    wait
        Turns until the next message.
    """

    request: ScanRequest
    head: bytes
    tail: bytes
    interval: int
    remaining: int | None
    wait: int = 0

    def echo(self) -> bytes:
        """Return the echo of the next message."""
        return b'%s%02d%s' % (self.head, self.remaining or 0, self.tail)

    def advance(self) -> None:
        """Count one more scan as sent."""
        self.wait = self.interval
        if self.remaining is not None:
            self.remaining -= 1


def message(echo: bytes, status: bytes, lines: list[bytes] | None = None) -> bytes:
    """Return a reply (section 7)."""
    return b'\n'.join([echo, scip.add_sum(status), *(lines or [])]) + b'\n\n'


def check_line(line: bytes, text: bytes) -> None:
    """Raise CommandError if a line, or the text after its semicolon, is not allowed."""
    if len(line) >= MAX_LINE:
        raise CommandError(b'0B')
    if len(text) > _MAX_TEXT:
        raise CommandError(b'0G')
    if not _TEXT.fullmatch(text):
        raise CommandError(b'0H')


def size_status(given: int, size: int) -> bytes:
    """Return the status for a wrong number of parameter characters (section 9)."""
    if given > size:
        return b'0E'
    return b'0F' if given else b'0C'


def number(digits: bytes, status: bytes) -> int:
    """Return a decimal number; raises CommandError with the status if it is not numeric."""
    if not digits.isdigit():
        raise CommandError(status)
    return int(digits)


def scan_request(line: bytes, parameters: bytes, last_requestable: int) -> ScanRequest:
    """Return what MD, MS, GD or GS requests (sections 8.1, 8.2); raises CommandError."""
    first = number(parameters[:4], b'01')
    last = number(parameters[4:8], b'02')
    cluster = number(parameters[8:10], b'03')
    if last > last_requestable:
        raise CommandError(b'04')
    if last < first:
        raise CommandError(b'05')
    return ScanRequest(first, last, cluster, 3 if line[1:2] == b'D' else 2)
