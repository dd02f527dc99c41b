"""Stamps that drift: of one input against those of another."""

from nodlidar_common.stamps import NS_PER_S

WINDOW_NS = 10 * NS_PER_S  # in which the message counts that was nearly the fastest on its way
AHEAD = 0.05  # share of messages that seem faster, as their stamps may be ahead of time
CONFIRMED = 2  # windows in a row, since one may have no fast message
MOST_NS = 5_000_000  # that stamps may move; jumps of scans by as much are noticed elsewhere

SCANS = 'scans'


class StampDrift:
    """Compares the times from stamp to arrival of other inputs with those of scans.

    They stay as they are at their least, window by window: a host may delay messages, but it never
    brings them early. The very least are left out, as single stamps may be ahead of time. If one
    input changes against another, stamps drift, or the clocks of the machines that stamp. If all
    change, a recording is played at another speed, and all begin anew. So does an input that was
    silent for a window, as it may be of another publisher.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget all, as after the clock was set."""
        self._end_ns: int | None = None
        self._late_ns: dict[str, list[int]] = {}
        self._least_late_ns: dict[str, int] = {}  # nearly the least of the window before
        self._first_ns: dict[str, int] = {}  # of the others, less that of scans
        self._moved_ns: dict[str, list[int]] = {}  # in the last windows
        self._apart_ns: dict[str, int] = {}  # as _first_ns, in the last window

    def add(self, name: str, late_ns: int, now_ns: int) -> None:
        """Add a message.

        Parameters
        ----------
        name
            Its input, SCANS or another one.
        late_ns
            Time from the last instant that it measured to its arrival [ns].
        now_ns
            Present time by a steady clock [ns].
        """
        if self._end_ns is None:
            self._end_ns = now_ns + WINDOW_NS
        if now_ns >= self._end_ns:
            self._end_window()
            self._end_ns = now_ns + WINDOW_NS
        self._late_ns.setdefault(name, []).append(late_ns)

    def forget(self, name: str) -> None:
        """Begin anew with an input whose stamps proved right as they are now."""
        self._first_ns.pop(name, None)
        self._moved_ns.pop(name, None)

    def _end_window(self) -> None:
        before_ns, late_ns, self._late_ns = self._least_late_ns, self._late_ns, {}
        self._least_late_ns = {
            name: sorted(each_ns)[int(AHEAD * len(each_ns))] for name, each_ns in late_ns.items()
        }
        both = before_ns.keys() & self._least_late_ns.keys()
        if both and all(
            abs(self._least_late_ns[name] - before_ns[name]) > MOST_NS for name in both
        ):
            self._first_ns.clear()
        of_scans_ns = self._least_late_ns.get(SCANS)
        apart_ns = self._apart_ns = {
            name: late_ns - of_scans_ns
            for name, late_ns in self._least_late_ns.items()
            if of_scans_ns is not None and name != SCANS
        }
        self._moved_ns = {
            name: [*self._moved_ns.get(name, []), apart_now_ns - self._first_ns[name]][-CONFIRMED:]
            for name, apart_now_ns in apart_ns.items()
            if name in self._first_ns
        }
        self._first_ns = {
            name: self._first_ns.get(name, apart_now_ns) for name, apart_now_ns in apart_ns.items()
        }

    def apart(self, name: str) -> float:
        """Return how much longer than scans another input came, in the last window [s]."""
        return self._apart_ns.get(name, 0) / NS_PER_S

    @property
    def early_scans(self) -> float:
        """How long before their last beam nearly all scans came, in the last window [s], or 0."""
        return max(-self._least_late_ns.get(SCANS, 0) / NS_PER_S, 0.0)

    @property
    def moved(self) -> dict[str, float]:
        """By how much scans are later stamped against other inputs than at first [s].

        Only those that surely moved.
        """
        return {
            name: moved_ns[-1] / NS_PER_S
            for name, moved_ns in self._moved_ns.items()
            if len(moved_ns) == CONFIRMED and (min(moved_ns) > MOST_NS or max(moved_ns) < -MOST_NS)
        }
