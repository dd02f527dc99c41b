"""What became of each scan that was due: it was published, or lost for one reason."""

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
    """Counts every scan once; ``due`` is always ``published`` plus all that is in ``lost``.

    How many scans were due is told by the lidar's own time, since damaged bytes do not tell how
    many scans they were.

    Attributes
    ----------
    published
        Scans published.
    lost
        Scans lost, by reason: ``checksum``, ``incomplete``, ``resync`` (the beginning or end was
        missing), ``verifying`` (the lidar stopped to verify an error), ``settling`` (the first of
        a stream, not dated yet), ``timestamp`` (it had a time that cannot be), ``missed`` (nothing
        of it was received).
    """

    def __init__(self) -> None:
        self.published = 0
        self.lost = Counter(dict.fromkeys(REASONS, 0))  # all keys, since other threads read it
        self._reasons: list[str] = []

    @property
    def due(self) -> int:
        """Scans that the lidar should have sent."""
        return self.published + self.lost.total()

    def drop(self, reason: str) -> None:
        """Take note of something that was received and is no good scan."""
        self._reasons.append(reason)

    def publish(self, due: int | None) -> None:
        """Take note of a scan that is published.

        Parameters
        ----------
        due
            Scans that were due since the last published one, this one included, >= 1; None if
            none was in this stream: then all that was received counts.
        """
        self._lose(len(self._reasons) if due is None else due - 1)
        self.published += 1

    def end(self, due: int | None) -> None:
        """Take note of the stream's end.

        Parameters
        ----------
        due
            Scans that were due since the last published one, >= 0; None if that is not known:
            then all that was received counts.
        """
        self._lose(len(self._reasons) if due is None else due)

    def _lose(self, count: int) -> None:
        """Count scans by the reasons so far; one that fell to pieces gave more than one."""
        reasons = self._reasons[:count]
        self.lost.update(reasons)
        self.lost[MISSED] += count - len(reasons)
        self._reasons.clear()
