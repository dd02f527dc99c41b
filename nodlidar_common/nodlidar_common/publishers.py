"""The publishers of a topic, told apart by sequence numbers, and the messages lost on the way."""

from collections import deque
from itertools import pairwise

# A number ahead by more is of another publisher, or of one that restarted.
MOST_LOST = 1000
MOST_STREAMS = 8
_RECENT = 100  # messages, whose publishers count as active


class Publishers:
    """Distinguishes the publishers of a topic by the sequence numbers of their messages.

    DDS passes on a number that each publisher counts up, but not the publisher. A message is
    attributed to the publisher whose last number is the next lower one.

    Attributes
    ----------
    lost
        Number of messages that were published but never arrived.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._streams: deque[list[int]] = deque(maxlen=MOST_STREAMS)  # identity, last number
        self._identities = 0
        self._recent: deque[int] = deque(maxlen=_RECENT)

    @property
    def active(self) -> int:
        """Number of publishers that alternate in the last messages passed to `note`."""
        identities = len(set(self._recent))
        if identities < 2:
            return 1
        changes = sum(one != other for one, other in pairwise(self._recent))
        # A publisher that restarts gets a new identity, but its old one does not return.
        return identities if changes > 2 else 1

    def add(self, number: int | None) -> int:
        """Add a message's sequence number; return its publisher's identity, 0 if unknown."""
        if number is None or not 0 < number < 2**63:
            return 0
        own = [stream for stream in self._streams if 0 < number - stream[1] <= MOST_LOST]
        if own:
            stream = max(own, key=lambda stream: stream[1])
            self.lost += number - stream[1] - 1
        else:
            self._identities += 1
            stream = [self._identities, number]
            self._streams.append(stream)
        stream[1] = number
        return stream[0]

    def note(self, identity: int) -> None:
        """Count a publisher as active: its message has the content that is in use."""
        self._recent.append(identity)
