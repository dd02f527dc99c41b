"""When the motor measured what a read brought, and whether that can be told."""

from collections import deque
from dataclasses import dataclass

BITS_PER_BYTE = 10
REQUEST_BYTES = 8
REPLY_OVERHEAD_BYTES = 6
USB_FRAME_NS = 1_000_000

LATEST_NS = 20_000_000
"""Beyond this excess [ns], a latency timer of 16 ms and some, the host itself was late."""


@dataclass(frozen=True, slots=True)
class WireTime:
    """The known times of one read transaction [ns].

    Attributes
    ----------
    request_ns, reply_ns
        Time of the read request and of its reply on the wire.
    delay_ns
        Time that the motor lets pass between the two (its return delay).
    """

    request_ns: int
    delay_ns: int
    reply_ns: int

    @classmethod
    def of_read(cls, length: int, baud_rate: int, delay_ns: int) -> 'WireTime':
        """Return the times of a read of `length` bytes at a bit rate [bit/s].

        A byte is ten bits on the wire; a read request has 8 bytes, its reply 6 and the data.
        """
        byte_ns = BITS_PER_BYTE * 1e9 / baud_rate
        return cls(
            round(REQUEST_BYTES * byte_ns),
            delay_ns,
            round((REPLY_OVERHEAD_BYTES + length) * byte_ns),
        )


def excess_ns(sent_ns: int, received_ns: int, wire: WireTime) -> int:
    """Return what a transaction took beyond its time on the wire [ns]."""
    return received_ns - sent_ns - wire.request_ns - wire.delay_ns - wire.reply_ns


def sample_time_ns(sent_ns: int, received_ns: int, wire: WireTime) -> int:
    """Return the instant [ns] at which the motor took its measurement.

    The motor measures between the last byte of the request and the first byte of the reply, that
    is in the middle of its return delay, `request + delay / 2` after the first bit left the host's
    adapter. What the transaction took beyond the wire time, `excess = received - sent - request -
    delay - reply`, went by on the two ways between host and adapter: operating system and USB.

    Up to one USB frame (1 ms) of it can be either way, and half of it is taken for the way out, an
    error of at most 0.5 ms. More than that is not on the way out: an adapter passes on what it is
    given in the next frame, but keeps what it receives until its latency timer (1 to 255 ms, 16 by
    default with FTDI) runs out. So what exceeds one frame is on the way back:

        stamp = sent + min(excess, 1 ms) / 2 + request + delay / 2

    A transaction that was shorter than its wire time (a simulated port) has no excess.
    """
    excess = max(excess_ns(sent_ns, received_ns, wire), 0)
    return sent_ns + min(excess, USB_FRAME_NS) // 2 + wire.request_ns + wire.delay_ns // 2


class UsualExcess:
    """Tells which transactions took so much longer than usual that their time is uncertain.

    A host that stood still, or a line that held bytes back, did so on one way or the other, and
    which one cannot be told. Up to one USB frame beyond the least of late is usual, or beyond what
    the latency timer of the adapter takes. If all take longer for a while, that becomes usual.

    Parameters
    ----------
    timer_ns
        What the adapter keeps replies for at most [ns].
    remembered
        How many transactions the least is taken from.
    """

    def __init__(self, timer_ns: int, remembered: int) -> None:
        self._timer_ns = timer_ns
        self._recent = deque([timer_ns], maxlen=remembered)

    def covers(self, excess_ns: int) -> bool:
        """Add a transaction's excess [ns] and tell whether it is usual."""
        self._recent.append(excess_ns)
        usual_ns = max(min(self._recent), self._timer_ns) + USB_FRAME_NS
        return excess_ns <= min(usual_ns, LATEST_NS)
