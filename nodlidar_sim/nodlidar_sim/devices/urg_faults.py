"""The faults of an emulated URG-04LX, which tests inject."""

from collections import deque

_RESUMED = 98


class UrgFaults:
    """Faults that the sensor has, or will have at its next scans.

    Attributes
    ----------
    malfunction
        Status of a permanent fault, 50-97; 0 if there is none.
    """

    def __init__(self) -> None:
        self.malfunction = 0
        self._statuses: deque[int] = deque()

    def come(self, *statuses: int) -> None:
        """Send statuses in place of the next scans.

        21-49: the stream stops to verify an error; 98: it resumes; 50-97: a permanent fault.
        """
        self._statuses.extend(statuses)

    def clear(self) -> None:
        """Remove all faults."""
        self.malfunction = 0
        self._statuses.clear()

    def next_status(self) -> int | None:
        """Remove and return the status to send in place of the next scan, None for a scan."""
        if not self._statuses:
            return None
        status = self._statuses.popleft()
        if 50 <= status < _RESUMED:
            self.malfunction = status
        return status
