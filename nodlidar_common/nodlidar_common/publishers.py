"""The publishers of a topic, told apart by sequence numbers, and the messages lost on the way."""

from collections import deque

from nodlidar_common.stamps import NS_PER_S

# A number ahead by more is of another publisher, or of one that restarted.
MOST_LOST = 1000
MOST_STREAMS = 8
_RETURN_NS = 10 * NS_PER_S  # a publisher that returns counts for this time
_SHORTEST_NS = NS_PER_S  # that several publishers stay active


class Publishers:
    """Distinguishes the publishers of a topic by the sequence numbers of their messages.

    DDS passes on a number that each publisher counts up, but not the publisher. A message is
    attributed to the publisher whose last number is the next lower one.

    A publisher returns if it sends after another one did. Several are active once two of them have
    returned within 10 s, until none returns for a second, or for twice its time between two
    messages if that is longer, but 10 s at most. One that restarts gets a new identity, but its
    old one does not return.

    Attributes
    ----------
    lost
        Number of messages that were published but never arrived.
    active
        Number of publishers that alternated up to the last message passed to `note`.
    """

    def __init__(self) -> None:
        self.lost, self.active = 0, 1
        self._streams: deque[list[int]] = deque(maxlen=MOST_STREAMS)  # identity, last number
        self._identities = 0
        self._forget(0)

    def _forget(self, now_ns: int) -> None:
        self._last, self._noted_ns, self._until_ns = 0, now_ns, now_ns
        self._heard_ns: dict[int, int] = {}
        self._returned_ns: dict[int, int] = {}

    def add(self, number: int | None) -> int:
        """Add a message's sequence number; return its publisher's identity, 0 if unknown."""
        if number is None or not 0 < number < 2**63:
            return 0
        own = [stream for stream in self._streams if 0 < number - stream[1] <= MOST_LOST]
        if own:
            # The latest publisher, if numbers are equal: an old one may have ended there.
            stream = max(own, key=lambda stream: (stream[1], stream[0]))
            self.lost += number - stream[1] - 1
        else:
            self._identities += 1
            stream = [self._identities, number]
            self._streams.append(stream)
        stream[1] = number
        return stream[0]

    def note(self, identity: int, now_ns: int) -> None:
        """Count a publisher as active: its message, at a time [ns], has the content in use."""
        if now_ns < self._noted_ns:  # the clock was set
            self._forget(now_ns)
        self._noted_ns, last, self._last = now_ns, self._last, identity
        heard_ns = self._heard_ns.get(identity)
        self._heard_ns[identity] = now_ns
        if identity != last:
            self._change(identity, heard_ns, now_ns)
        self.active = len(self._returned_ns) if now_ns < self._until_ns else 1

    def _change(self, identity: int, heard_ns: int | None, now_ns: int) -> None:
        """Take the message after one of another publisher; this one was heard before, or never."""
        old_ns = now_ns - _RETURN_NS
        self._heard_ns = {key: ns for key, ns in self._heard_ns.items() if ns > old_ns}
        self._returned_ns = {key: ns for key, ns in self._returned_ns.items() if ns > old_ns}
        if heard_ns is None or heard_ns <= old_ns:
            return
        self._returned_ns[identity] = now_ns
        if len(self._returned_ns) > 1:
            silence_ns = max(min(2 * (now_ns - heard_ns), _RETURN_NS), _SHORTEST_NS)
            self._until_ns = max(self._until_ns, now_ns + silence_ns)
