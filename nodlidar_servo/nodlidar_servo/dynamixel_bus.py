"""Reads and writes of one Dynamixel bus, through the Dynamixel SDK on a port that is open.

The SDK's packet handler builds and parses the packets. Its port handler is replaced: that one
opens the port unlocked and polls it at full speed while it waits. Its read calls are not used: on
a reply without data they raise IndexError, and on a short one they take the checksum for data.
"""

from collections.abc import Callable
from dataclasses import dataclass
import re
from typing import Protocol

from dynamixel_sdk import (
    COMM_RX_CORRUPT,
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    INST_READ,
    INST_WRITE,
    PacketHandler,
    PortHandler,
)
from nodlidar_common.errors import DeviceError
from nodlidar_common.serial_port import port_errors

PROTOCOL = 1.0
REPLY_TIMEOUT = 0.05
"""Longest wait for a reply [s]: a latency timer of 16 ms three times over."""

_DRAINED_AT_ONCE = 256

STATUS_BITS = {
    0x01: 'input voltage',
    0x02: 'angle limit',
    0x04: 'overheating',
    0x08: 'range',
    0x10: 'checksum',
    0x20: 'overload',
    0x40: 'instruction',
}
REFUSALS = 0x02 | 0x08 | 0x10 | 0x40
"""The status bits of a request that was not carried out; the others are the motor's state."""


class ReplyError(DeviceError):
    """A request that was not answered as it should be; `reason` is a short name for counting."""

    reason = 'failed'


class NoAnswerError(ReplyError):
    """Nothing came back in time."""

    reason = 'no answer'


class CorruptReplyError(ReplyError):
    """What came back was incomplete, or its checksum or length was wrong."""

    reason = 'corrupt reply'


class LateReplyError(ReplyError):
    """The reply came so late that nobody can tell when the motor measured."""

    reason = 'late reply'


class RefusedError(ReplyError):
    """The motor refused the request."""

    reason = 'refused'


class ByteStream(Protocol):
    """The part of a pyserial port that is used here."""

    timeout: float | None

    def read(self, size: int) -> bytes:
        """Return up to size bytes, fewer only when the timeout has passed."""

    def write(self, data: bytes) -> int | None:
        """Send the data and return its length."""

    def reset_input_buffer(self) -> None:
        """Drop what has arrived."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What a read brought, when, and in what state the motor says it is.

    Attributes
    ----------
    data
        The registers' bytes.
    status
        The status bits of the motor, see :func:`status_names`; 0 if all is well.
    sent_ns, received_ns
        Host times just before the request was handed to the port and just after the last byte
        of the reply was read [ns].
    """

    data: bytes
    status: int
    sent_ns: int
    received_ns: int


def write_packet(servo_id: int, address: int, data: bytes) -> bytes:
    """Return the bytes of a write request of Protocol 1.0."""
    body = bytes([servo_id, len(data) + 3, INST_WRITE, address, *data])
    return b'\xff\xff' + body + bytes([~sum(body) & 0xFF])


def write_confirmation(servo_id: int) -> bytes:
    """Return the regular expression of the replies that confirm a write, whatever is reported."""
    replies = (bytes([servo_id, 2, status]) for status in range(256) if not status & REFUSALS)
    return b'|'.join(
        re.escape(b'\xff\xff' + body + bytes([~sum(body) & 0xFF])) for body in replies
    )


def status_names(status: int) -> str:
    """Return the names of all status bits that are set, separated by commas."""
    return ', '.join(name for bit, name in STATUS_BITS.items() if status & bit)


class OpenPort(PortHandler):
    """The SDK's port handler on an open port: its reads block, its errors are PortErrors.

    A read comes back short only when the port's timeout has passed, so that a packet timeout
    needs no clock.
    """

    def __init__(self, stream: ByteStream, clock: Callable[[], int]) -> None:
        super().__init__('')
        with port_errors():
            stream.timeout = REPLY_TIMEOUT
        self.ser = stream
        self.is_open = True
        self.sent_ns = 0
        self.received_ns = 0
        self._clock = clock

    def clearPort(self) -> None:  # noqa: N802
        """Drop what has arrived."""
        with port_errors():
            self.ser.reset_input_buffer()

    def writePort(self, packet: list[int]) -> int | None:  # noqa: N802
        """Send a packet and keep the time just before."""
        self.sent_ns = self._clock()
        with port_errors():
            return self.ser.write(bytes(packet))

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return `length` bytes, or fewer if the timeout passes, and keep the time just after."""
        with port_errors():
            data = self.ser.read(max(length, 0))
        self.received_ns = self._clock()
        return data

    def drain(self) -> None:
        """Drop what comes until nothing does for the length of the timeout.

        A reply that comes after its timeout would else be taken for that of the next request: an
        old measurement with a new time.
        """
        while self.readPort(_DRAINED_AT_ONCE):
            pass

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Tell that time is up: the SDK asks only after a short read."""
        return True


class DynamixelBus:
    """Requests to the motor with one ID on an open port.

    Every method raises ReplyError (one of its kinds) if the motor does not answer as it should,
    and PortError if the port goes away.
    """

    def __init__(self, stream: ByteStream, servo_id: int, clock: Callable[[], int]) -> None:
        self._port = OpenPort(stream, clock)
        self._id = servo_id
        self._packets = PacketHandler(PROTOCOL)
        self._reply_is_due = False

    def read(self, address: int, length: int) -> Reply:
        """Read registers in one transaction."""
        status, data = self._request(INST_READ, [address, length])
        if not data:
            self._check_accepted(status)
        if len(data) != length:
            raise CorruptReplyError(f'{self._name} sent {len(data)} bytes instead of {length}')
        return Reply(data, status, self._port.sent_ns, self._port.received_ns)

    def write(self, address: int, data: bytes) -> None:
        """Write registers and wait until the motor confirms."""
        status, _ = self._request(INST_WRITE, [address, *data])
        self._check_accepted(status)

    def post(self, address: int, data: bytes) -> None:
        """Write registers without confirmation (a sync write, which has no reply to wait for)."""
        block = [self._id, *data]
        try:
            result = self._packets.syncWriteTxOnly(
                self._port, address, len(data), block, len(block)
            )
        finally:
            self._port.is_using = False
        self._check(result)

    def _request(self, instruction: int, parameters: list[int]) -> tuple[int, bytes]:
        """Return the status and the data of the reply to a request."""
        if self._reply_is_due:
            self._port.drain()
        self._reply_is_due = True
        header = [0xFF, 0xFF, self._id, len(parameters) + 2, instruction]
        try:
            reply, result, status = self._packets.txRxPacket(self._port, [*header, *parameters, 0])
        finally:
            self._port.is_using = False  # the SDK leaves it set when the port raises
        self._check(result)
        self._reply_is_due = False
        return status, bytes(reply[len(header) : -1])

    def _check(self, result: int) -> None:
        if result == COMM_RX_TIMEOUT:
            raise NoAnswerError(f'{self._name} does not answer')
        if result == COMM_RX_CORRUPT:
            raise CorruptReplyError(f'{self._name} sent a corrupt reply')
        if result != COMM_SUCCESS:
            raise ReplyError(f'{self._name}: {self._packets.getTxRxResult(result)}')

    def _check_accepted(self, status: int) -> None:
        if status & REFUSALS:
            raise RefusedError(f'{self._name} refused the request: {status_names(status)}')

    @property
    def _name(self) -> str:
        return f'the servo with ID {self._id}'
