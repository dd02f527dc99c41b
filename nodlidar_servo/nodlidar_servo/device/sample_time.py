"""The time of a measurement, and whether it is known."""

from collections import deque
from dataclasses import dataclass
from functools import cache

BITS_PER_BYTE = 10
USB_FRAME_NS = 1_000_000

LATEST_NS = 20_000_000
"""Beyond this excess [ns], more than a latency timer of 16 ms, the host itself was late."""


@dataclass(frozen=True, slots=True)
class WireTime:
    """The known times of one read transaction [ns].

    Attributes
    ----------
    request_ns, reply_ns
        Time of the read request and of its reply on the wire.
    delay_ns
        Time that the motor waits between the two (its return delay).
    """

    request_ns: int
    delay_ns: int
    reply_ns: int

    @classmethod
    @cache
    def of_read(cls, request: int, reply: int, baud_rate: int, delay_ns: int) -> 'WireTime':
        """Return the times of a request and a reply of some bytes, at a bit rate [bit/s].

        A byte is ten bits on the wire.
        """
        byte_ns = BITS_PER_BYTE * 1e9 / baud_rate
        return cls(round(request * byte_ns), delay_ns, round(reply * byte_ns))


def excess_ns(sent_ns: int, received_ns: int, wire: WireTime) -> int:
    """Return the duration of a transaction beyond its time on the wire [ns]."""
    return received_ns - sent_ns - wire.request_ns - wire.delay_ns - wire.reply_ns


def sample_time_ns(sent_ns: int, received_ns: int, wire: WireTime) -> int:
    """Return the instant [ns] at which the motor took its measurement.

    The motor measures between the last byte of the request and the first byte of the reply: on
    average in the middle of its return delay, `request + delay / 2` after the first bit left the
    host's adapter. The excess over the wire time, `excess = received - sent - request - delay -
    reply`, is the time on the ways between host and adapter: operating system and USB.

    Up to one USB frame (1 ms) of it can be on either way. Half of this is attributed to the way
    out, an error of at most 0.5 ms. The rest is on the way back, since an adapter sends in the
    next frame, but holds what it receives until its latency timer (1 to 255 ms, 16 by default with
    FTDI) expires:

        stamp = sent + min(excess, 1 ms) / 2 + request + delay / 2

    A transaction shorter than its wire time (on a simulated port) has no excess.
    """
    excess = max(excess_ns(sent_ns, received_ns, wire), 0)
    return sent_ns + min(excess, USB_FRAME_NS) // 2 + wire.request_ns + wire.delay_ns // 2


class UsualExcess:
    """Decides which transactions took so long that the time of their measurement is uncertain.

    If the host or the line paused, it is unknown on which way. An excess is usual up to one USB
    frame above the least recent one, or above the adapter's latency timer. If all transactions
    take longer for a while, that becomes usual.

    Parameters
    ----------
    timer_ns
        Latency timer of the adapter [ns].
    remembered
        Number of recent transactions.
    """

    def __init__(self, timer_ns: int, remembered: int) -> None:
        self._timer_ns = timer_ns
        self._recent = deque([timer_ns], maxlen=remembered)

    def add(self, excess_ns: int) -> bool:
        """Add a transaction's excess [ns]; return whether it is usual."""
        self._recent.append(excess_ns)
        usual_ns = max(min(self._recent), self._timer_ns) + USB_FRAME_NS
        return excess_ns <= min(usual_ns, LATEST_NS)
