"""The base class of events."""


class Event:
    """Something that happened, or is asked for, while launching."""

    name = 'launch.Event'
