"""Why a transform is not available."""


class TransformException(Exception):  # noqa: N818
    """A frame does not exist, or the frames form a loop or are not in one tree."""


class ExtrapolationException(TransformException):
    """The time is outside of the known times."""


class InvalidArgumentException(TransformException):
    """A transform to be set is not between two frames, or has no pose."""
