"""Filters that pass messages on: what nodlidar calls of Jazzy's Python API.

A filter calls what was registered with it; filters take filters as their inputs.
"""

from underlay_refusal import Partial, refuse

__all__ = ['SimpleFilter', 'Subscriber']
__getattr__ = refuse(__name__, __all__)


class SimpleFilter(Partial):
    """A filter that callbacks can be registered with."""

    def __init__(self):
        self._callbacks = []

    def registerCallback(self, cb):  # noqa: N802
        """Call `cb` with each output."""
        self._callbacks.append(cb)

    def signalMessage(self, *msg):  # noqa: N802
        """Pass an output, one or several messages, to every callback."""
        for callback in self._callbacks:
            callback(*msg)


class Subscriber(SimpleFilter):
    """A subscription as a filter; keyword arguments as for ``Node.create_subscription``.

    The subscription is its attribute `sub`.
    """

    def __init__(self, node, msg_type, topic, /, **kwargs):
        super().__init__()
        self.sub = node.create_subscription(msg_type, topic, self.callback, **kwargs)

    def callback(self, msg):
        """Pass on a message that arrived."""
        self.signalMessage(msg)
