"""The faults of an emulated URG-04LX: real ones, for tests, and those that DB simulates.

Section numbers are those of Hokuyo's specification C-42-03320B.
"""

from collections import deque

_RESUMED = 98
_SCRIPTS = {b'03': (21, _RESUMED), b'04': (21, 50), b'05': (50,)}
_SCANS_BEFORE = 20


class UrgFaults:
    """What is wrong with the sensor, or is about to be.

    Attributes
    ----------
    malfunction
        Status of a fault that lasts, 50-97; 0 if there is none.
    """

    def __init__(self) -> None:
        self._statuses: deque[int] = deque()
        self.clear()

    def come(self, *statuses: int) -> None:
        """Send statuses in place of the next scans: 21-49, 98 once all is well, 50-97 for good."""
        self._statuses.extend(statuses)

    def clear(self) -> None:
        """Be sound again."""
        self.malfunction = 0
        self._simulation: bytes | None = None
        self._statuses.clear()

    def next_status(self, scans_sent: int) -> int | None:
        """Return the status to send in place of a stream's next scan, None to send the scan."""
        waiting = self._simulation is not None and scans_sent < _SCANS_BEFORE
        if waiting or not self._statuses:
            return None
        status = self._statuses.popleft()
        if 50 <= status < _RESUMED:
            self.malfunction = status
        return status

    def simulate(self, kind: bytes) -> bytes | None:
        """Do what DB says (section 8.10) and return the status if it is refused."""
        if kind == b'10':
            return self._end_simulation()
        if kind == b'01':
            return b'04'  # a malfunction in SCIP 1.1, which is not emulated
        if kind != b'02' and kind not in _SCRIPTS:
            return b'01'
        if kind == self._simulation:
            return b'02'
        if self.malfunction and self._simulation is None:
            return b'05'
        self._simulation = kind
        self._statuses = deque(_SCRIPTS.get(kind, ()))
        self.malfunction = 50 if kind == b'02' else 0
        return None

    def _end_simulation(self) -> bytes | None:
        if self._simulation is None:
            return b'03'
        self.clear()
        return None
