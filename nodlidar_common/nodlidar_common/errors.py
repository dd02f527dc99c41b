"""The errors that nodlidar raises on purpose; each says what was wrong and what would be right."""


class NodlidarError(Exception):
    """Base of every error that nodlidar raises on purpose."""


class ParameterError(NodlidarError, ValueError):
    """A value outside what a parameter or a command allows.

    Parameters
    ----------
    key, limit, value
        The parameter's name, what it allows in words, and what it was given.
    """

    def __init__(self, key: str, limit: str, value: object) -> None:
        super().__init__(f"'{key}' must be {limit}, but is {value!r}")
        self.key = key
        self.limit = limit
        self.value = value


class DeviceError(NodlidarError):
    """A device that cannot be used as it is: no answer, a refusal, a fault of its own."""


class StoppedError(DeviceError):
    """A wait for a device that was given up because the node is to stop."""


class PortError(DeviceError):
    """A serial port that cannot be opened, or that went away."""
