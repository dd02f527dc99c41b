"""Why a transform is not to be had."""


class TransformException(Exception):  # noqa: N818
    """Base of all of them."""


class ConnectivityException(TransformException):
    """The frames are not in one tree."""


class LookupException(TransformException):
    """A frame does not exist, or the frames form a loop."""


class ExtrapolationException(TransformException):
    """The time is outside of what is known."""


class InvalidArgumentException(TransformException):
    """A frame's name is empty or starts with a slash."""


class TimeoutException(TransformException):
    """The transform did not come in time; here for those who catch it, never raised."""
