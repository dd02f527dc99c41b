"""Filters that pass on, remember or match up messages: the Python API of Jazzy.

A filter calls what was registered with it; filters take filters as their inputs.
"""

from itertools import product
import threading

from rclpy.clock import ROSClock
from rclpy.duration import Duration
from rclpy.logging import get_logger
from rclpy.time import Time
from underlay_refusal import refuse

__all__ = [
    'ApproximateTimeSynchronizer',
    'Cache',
    'SimpleFilter',
    'Subscriber',
    'TimeSynchronizer',
]
__getattr__ = refuse(__name__, __all__)


class SimpleFilter:
    """Something that callbacks can be registered with."""

    def __init__(self):
        self.callbacks = {}

    def registerCallback(self, cb, *args):  # noqa: N802
        """Have `cb` called with each output followed by `args`; return the connection's number."""
        connection = len(self.callbacks)
        self.callbacks[connection] = (cb, args)
        return connection

    def signalMessage(self, *msg):  # noqa: N802
        """Give an output, one or several messages, to every callback."""
        for callback, args in self.callbacks.values():
            callback(*msg, *args)


class Subscriber(SimpleFilter):
    """A subscription as a filter; keyword arguments as for ``Node.create_subscription``."""

    def __init__(self, node, msg_type, topic, /, **kwargs):
        super().__init__()
        self.node = node
        self.topic = topic
        kwargs.setdefault('qos_profile', 10)
        self.sub = node.create_subscription(msg_type, topic, self.callback, **kwargs)

    def callback(self, msg):
        """Pass on a message that arrived."""
        self.signalMessage(msg)

    def getTopic(self):  # noqa: N802
        """Return the topic as it was given."""
        return self.topic

    def __getattr__(self, key):
        # Anything else is the subscription's; 'sub' itself gets here only before it is made.
        if key == 'sub':
            raise AttributeError(key)
        return getattr(self.sub, key)


class Cache(SimpleFilter):
    """Remembers the last `cache_size` messages that arrived, in the order of arrival.

    The times are those of the headers (``rclpy.time.Time``); a message without one is refused
    with a warning unless `allow_headerless`, which takes the time of arrival.
    """

    def __init__(self, f, cache_size=1, allow_headerless=False):
        super().__init__()
        self.cache_size = cache_size
        self.allow_headerless = allow_headerless
        self.cache_msgs = []
        self.cache_times = []
        self.connectInput(f)

    def connectInput(self, f):  # noqa: N802
        """Take messages from a filter."""
        self.incoming_connection = f.registerCallback(self.add)

    def add(self, msg):
        """Remember a message, forget what is too old, pass the message on."""
        stamp = _stamp(msg, self.allow_headerless, 'message_filters_cache')
        if stamp is None:
            return
        self.cache_msgs.append(msg)
        self.cache_times.append(stamp)
        if len(self.cache_msgs) > self.cache_size:
            del self.cache_msgs[0]
            del self.cache_times[0]
        self.signalMessage(msg)

    def getInterval(self, from_stamp, to_stamp):  # noqa: N802
        """Return the messages from one time to another, both included."""
        assert from_stamp <= to_stamp
        return self._where(lambda time: from_stamp <= time <= to_stamp)

    def getElemAfterTime(self, stamp):  # noqa: N802
        """Return the first to have arrived of the messages not before a time, or None."""
        return next(iter(self._where(lambda time: time >= stamp)), None)

    def getElemBeforeTime(self, stamp):  # noqa: N802
        """Return the last to have arrived of the messages not after a time, or None."""
        return next(reversed(self._where(lambda time: time <= stamp)), None)

    def getLastestTime(self):  # noqa: N802
        """Return the time of the message that arrived last, or None (the name is Jazzy's)."""
        return self.cache_times[-1] if self.cache_times else None

    def getOldestTime(self):  # noqa: N802
        """Return the time of the message that arrived first, or None."""
        return self.cache_times[0] if self.cache_times else None

    def getLast(self):  # noqa: N802
        """Return the first to have arrived of the messages not before the latest, or None."""
        return self.getElemAfterTime(self.getLastestTime()) if self.cache_times else None

    def _where(self, condition):
        times_and_messages = zip(self.cache_times, self.cache_msgs, strict=True)
        return [message for time, message in times_and_messages if condition(time)]


class TimeSynchronizer(SimpleFilter):
    """Passes on sets of messages, one of each input, that have the same stamp.

    Of each input the `queue_size` messages with the latest stamps wait for the others.
    """

    def __init__(self, fs, queue_size):
        super().__init__()
        self.queue_size = queue_size
        self.lock = threading.Lock()
        self.connectInput(fs)

    def connectInput(self, fs):  # noqa: N802
        """Take messages from filters."""
        self.queues = [{} for _ in fs]
        self.input_connections = [
            f.registerCallback(self.add, queue, index)
            for index, (f, queue) in enumerate(zip(fs, self.queues, strict=True))
        ]

    def add(self, msg, my_queue, my_queue_index=None):
        """Let a message wait and pass on every set that it completes."""
        with self.lock:
            self._enqueue(msg, Time.from_msg(msg.header.stamp).nanoseconds, my_queue)
            for stamp in sorted(set.intersection(*map(set, self.queues))):
                self._pass_on([stamp] * len(self.queues))

    def _enqueue(self, msg, stamp, queue):
        queue[stamp] = msg
        while len(queue) > self.queue_size:
            del queue[min(queue)]

    def _pass_on(self, stamps):
        self.signalMessage(*(q[stamp] for q, stamp in zip(self.queues, stamps, strict=True)))
        for queue, stamp in zip(self.queues, stamps, strict=True):
            del queue[stamp]


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Passes on sets of messages, one of each input, whose stamps span less than `slop` seconds.

    A message is matched as it arrives, with the nearest of what waits; the later inputs' nearest
    are varied first.
    """

    def __init__(self, fs, queue_size, slop, allow_headerless=False):
        super().__init__(fs, queue_size)
        self.slop = Duration(seconds=slop)
        self.allow_headerless = allow_headerless

    def add(self, msg, my_queue, my_queue_index=None):
        """Let a message wait and pass on the set that it completes, if any."""
        time = _stamp(msg, self.allow_headerless, 'message_filters_approx')
        if time is None:
            return
        with self.lock:
            self._enqueue(msg, time.nanoseconds, my_queue)
            for stamps in self._candidates(time.nanoseconds, my_queue_index):
                if self._match(stamps):
                    self._pass_on(stamps)
                    break

    def _candidates(self, stamp, index):
        """Return the sets of stamps that go with a new one, the nearest of each input first."""
        nearest = [self._near(q, stamp) for i, q in enumerate(self.queues) if i != index]
        if index is not None:
            nearest.insert(index, [stamp])
        return product(*nearest)

    def _near(self, queue, stamp):
        near = [s for s in queue if abs(s - stamp) <= self.slop.nanoseconds]
        return sorted(near, key=lambda s: abs(s - stamp))

    def _match(self, stamps):
        waiting = all(s in queue for queue, s in zip(self.queues, stamps, strict=True))
        return waiting and max(stamps) - min(stamps) < self.slop.nanoseconds


def _stamp(msg, allow_headerless, logger_name):
    """Return a message's time, or None (and warn) if it has none and may not."""
    stamp = getattr(getattr(msg, 'header', None), 'stamp', None)
    if stamp is not None:
        return stamp if hasattr(stamp, 'nanoseconds') else Time.from_msg(stamp)
    if allow_headerless:
        return ROSClock().now()
    get_logger(logger_name).warning(
        "dropped a message without a stamp: 'allow_headerless' would give it the time of arrival"
    )
    return None
