"""Why a transform is not available."""


class TransformException(Exception):  # noqa: N818
    """Base of the others."""


class ConnectivityException(TransformException):
    """The frames are not in one tree."""


class LookupException(TransformException):
    """A frame does not exist, or the frames form a loop."""


class ExtrapolationException(TransformException):
    """The time is outside of the known times."""


class InvalidArgumentException(TransformException):
    """A frame's name is empty or starts with a slash."""
