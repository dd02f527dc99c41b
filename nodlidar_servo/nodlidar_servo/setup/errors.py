"""Why a servo cannot be set up, each with what to do."""

from nodlidar_common.errors import DeviceError


class NoServoError(DeviceError):
    """No servo answers at any bit rate, with any ID, of either protocol."""


class LidarError(DeviceError):
    """A lidar answers, or something streams, at the port of the servo."""


class SharedIdError(DeviceError):
    """Two servos have one ID, or the line is disturbed."""


class SeveralServosError(DeviceError):
    """Several servos answer, and none was chosen."""


class WrongModelError(DeviceError):
    """The servo is not the model that was named, or none that the node drives."""


class LockedError(DeviceError):
    """The servo's settings are locked until its power is cut."""


class NotWrittenError(DeviceError):
    """A register does not have the value that was written."""
