"""The messages of one source, where several send on a topic."""

from nodlidar_common.stamps import NS_PER_S

_SILENCE_NS = NS_PER_S  # after which another source counts


class OneSource:
    """Admits the messages of the source that was heard first, until it is silent for a second."""

    def __init__(self) -> None:
        self._source: object = None
        self._heard_ns = 0

    def admits(self, source: object, now_ns: int) -> bool:
        """Return whether a message of a source counts, which came at an instant [ns]."""
        is_silent = not 0 <= now_ns - self._heard_ns <= _SILENCE_NS
        if self._source is not None and source != self._source and not is_silent:
            return False
        self._source, self._heard_ns = source, now_ns
        return True
