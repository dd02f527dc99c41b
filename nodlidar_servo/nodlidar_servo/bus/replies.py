"""Replies of a motor, and the kinds of failure, each with a name for counting."""

from dataclasses import dataclass

from nodlidar_common.errors import DeviceError

STATUS_BITS = {
    0x01: 'input voltage',
    0x02: 'angle limit',
    0x04: 'overheating',
    0x08: 'range',
    0x10: 'checksum',
    0x20: 'overload',
    0x40: 'instruction',
    # The hardware errors of Protocol 2.0, a byte higher.
    0x0100: 'input voltage',
    0x0400: 'overheating',
    0x0800: 'motor encoder',
    0x1000: 'electrical shock',
    0x2000: 'overload',
    # The status of Feetech's STS servos, two bytes higher.
    0x010000: 'input voltage',
    0x020000: 'position sensor',
    0x040000: 'overheating',
    0x080000: 'overcurrent',
    0x100000: 'angle',
    0x200000: 'overload',
}
HARDWARE_ERRORS, STS_ERRORS = 8, 16
"""Bits by which hardware errors of Protocol 2.0, and the status of STS servos, are shifted."""

REFUSALS = 0x02 | 0x08 | 0x10 | 0x40
"""The status bits of Protocol 1.0 of a refused request; the others are the motor's state."""


class ReplyError(DeviceError):
    """A request without a proper answer; `reason` is a short name for counting."""

    reason = 'failed'


class NoAnswerError(ReplyError):
    """No reply came in time."""

    reason = 'no answer'


class CorruptReplyError(ReplyError):
    """The reply was incomplete, or its checksum or length was wrong."""

    reason = 'corrupt reply'


class LateReplyError(ReplyError):
    """The reply took longer than usual, so that the time of the measurement is unknown."""

    reason = 'late reply'


class PositionError(ReplyError):
    """The servo cannot have the reported position."""

    reason = 'impossible position'


class RefusedError(ReplyError):
    """The motor refused the request."""

    reason = 'refused'


@dataclass(frozen=True, slots=True)
class Reply:
    """Result of a read, its times, and the state of the motor.

    Attributes
    ----------
    data
        The requested bytes.
    request_size, size
        Bytes of the request and of the reply on the wire, see :meth:`.DynamixelBus.read`.
    status
        The status byte of the motor; 0 if all is well.
    sent_ns, received_ns
        Host times just before the request was sent and just after the last byte of the reply was
        read [ns].
    """

    data: bytes
    request_size: int
    size: int
    status: int
    sent_ns: int
    received_ns: int


def status_names(status: int) -> str:
    """Return the names of all set status bits, separated by commas."""
    return ', '.join(name for bit, name in STATUS_BITS.items() if status & bit)
