"""Which publishers messages come from, and which of theirs were lost on the way."""

from collections import deque
from itertools import pairwise

# A number ahead by more is of another publisher, or of one that began anew.
MOST_LOST = 1000
MOST_STREAMS = 8
_REMEMBERED = 100  # messages, by which those who publish at present are told


class Publishers:
    """Tells publishers of a topic apart by the numbers that each gives its messages.

    DDS passes on a number that every publisher counts up, but not whose it is: a message is of the
    publisher whose last number is next below.

    Attributes
    ----------
    lost
        Messages that were published, but never arrived.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._streams: deque[list[int]] = deque(maxlen=MOST_STREAMS)  # identity, last number
        self._made = 0
        self._telling: deque[int] = deque(maxlen=_REMEMBERED)

    @property
    def telling(self) -> int:
        """How many of them told of it in the last messages, by turns."""
        changes = sum(one != other for one, other in pairwise(self._telling))
        # One that began anew is another, but the former does not come back.
        return len(set(self._telling)) if changes > 2 else 1

    def add(self, number: int | None) -> int:
        """Add a message's number, if there is one; return whose it is."""
        if number is None or not 0 < number < 2**63:
            return 0
        own = [stream for stream in self._streams if 0 < number - stream[1] <= MOST_LOST]
        if own:
            stream = max(own, key=lambda stream: stream[1])
            self.lost += number - stream[1] - 1
        else:
            self._made += 1
            stream = [self._made, number]
            self._streams.append(stream)
        stream[1] = number
        return stream[0]

    def note(self, identity: int) -> None:
        """Note whose message told of what matters."""
        self._telling.append(identity)
