"""Accounts for each scan that was due: it was published, or lost for one reason."""

from collections import Counter

MISSED = 'missed'
CHECKSUM = 'checksum'
INCOMPLETE = 'incomplete'
RESYNC = 'resync'
VERIFYING = 'verifying'
SETTLING = 'settling'
TIMESTAMP = 'timestamp'
REASONS = (MISSED, CHECKSUM, INCOMPLETE, RESYNC, VERIFYING, SETTLING, TIMESTAMP)


class ScanAccount:
    """Counts every scan once; ``due`` is always ``published`` plus the total of ``lost``.

    The number of scans that were due follows from the lidar's own time, since damaged bytes do not
    show how many scans they were.

    Attributes
    ----------
    published
        Scans published.
    lost
        Scans lost, by reason: ``checksum``, ``incomplete``, ``resync`` (the beginning or end was
        missing), ``verifying`` (the lidar stopped to verify an error), ``settling`` (at the start
        of a stream, not dated yet), ``timestamp`` (it had an impossible time), ``missed`` (nothing
        of it was received).
    """

    def __init__(self) -> None:
        self.published = 0
        self.lost = Counter(dict.fromkeys(REASONS, 0))
        self._reasons: list[str] = []

    @property
    def due(self) -> int:
        """Scans that the lidar should have sent."""
        return self.published + self.lost.total()

    def drop(self, reason: str) -> None:
        """Note received data that are not a good scan."""
        self._reasons.append(reason)

    def publish(self, due: int | None) -> None:
        """Count a scan that is published.

        Parameters
        ----------
        due
            Scans that were due since the last published one, including this one, >= 1; None if
            there was none in this stream: then all received data count.
        """
        self._lose(len(self._reasons) if due is None else due - 1)
        self.published += 1

    def end(self, due: int | None) -> None:
        """Count the scans at the end of the stream.

        Parameters
        ----------
        due
            Scans that were due since the last published one, >= 0; None if that is unknown: then
            all received data count.
        """
        self._lose(len(self._reasons) if due is None else due)

    def _lose(self, count: int) -> None:
        """Count scans by the reasons so far; one damaged scan may have left several."""
        reasons = self._reasons[:count]
        self.lost.update(reasons)
        self.lost[MISSED] += count - len(reasons)
        self._reasons.clear()
