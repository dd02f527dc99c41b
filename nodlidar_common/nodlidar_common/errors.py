"""The errors that nodlidar raises on purpose; each states the limit and the value."""


class NodlidarError(Exception):
    """Base of every error that nodlidar raises on purpose."""


class ParameterError(NodlidarError, ValueError):
    """A value outside what a parameter or a command allows.

    Parameters
    ----------
    key, limit, value
        The parameter's name, the allowed values in words, and the actual value.
    """

    def __init__(self, key: str, limit: str, value: object) -> None:
        super().__init__(f"'{key}' must be {limit}, but is {value!r}")
        self.key = key
        self.limit = limit
        self.value = value


class ScanError(NodlidarError):
    """A scan that cannot be used, or not be placed.

    Attributes
    ----------
    reason
        The message without the value; drops are counted by it.
    """

    def __init__(self, reason: str, value: object = None) -> None:
        super().__init__(reason if value is None else f'{reason}: {value}')
        self.reason = reason


class DeviceError(NodlidarError):
    """A device that cannot be used: it does not answer, refuses, or is faulty."""


class StoppedError(DeviceError):
    """A wait for a device that ended early because the node stops."""


class PortError(DeviceError):
    """A serial port or connection that cannot be opened, or went away."""
