"""How often joint states are published; no ROS in here."""

from collections.abc import Iterable


class Throttle:
    """Keeps transforms of a joint an interval apart, by the stamps of its states [ns]."""

    def __init__(self) -> None:
        self._published_ns: dict[str, int] = {}
        self._seen_ns = 0

    def went_back(self, now_ns: int) -> bool:
        """Return whether the clock was set back since the last call; then all joints are due."""
        back = now_ns < self._seen_ns
        if back:
            self._published_ns.clear()
        self._seen_ns = now_ns
        return back

    def due(self, names: Iterable[str], stamp_ns: int, now_ns: int, interval_ns: int) -> bool:
        """Return whether the joint that was published longest ago is due.

        A joint published with a stamp in the future counts as published now.
        """
        last_ns = min([now_ns, *(self._published_ns.get(name, 0) for name in names)])
        return stamp_ns >= last_ns + interval_ns

    def published(self, names: Iterable[str], stamp_ns: int) -> None:
        """Note that joints were published."""
        self._published_ns.update(dict.fromkeys(names, stamp_ns))
