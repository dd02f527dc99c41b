"""Reads and writes on one Dynamixel bus, through the Dynamixel SDK on an open port.

The SDK's packet handler builds and parses the packets. Its port handler is replaced, since it
opens the port unlocked and polls it at full speed while it waits. Its read calls are not used: on
a reply without data they raise IndexError, on a short one they take the checksum for data, and
they accept a late reply as the answer to a later request.
"""

from collections.abc import Callable

from dynamixel_sdk import (
    COMM_RX_CORRUPT,
    COMM_RX_TIMEOUT,
    COMM_SUCCESS,
    INST_READ,
    INST_WRITE,
    PacketHandler,
    PortHandler,
)
from nodlidar_common.serial_port import port_errors, SerialPort
from nodlidar_servo.replies import (
    CorruptReplyError,
    NoAnswerError,
    REFUSALS,
    RefusedError,
    Reply,
    ReplyError,
    status_names,
)
from nodlidar_servo.reply_timeout import LONGEST, ReplyTimeout

PROTOCOL = 1.0
OVERHEAD = 6
"""Bytes of a packet besides its parameters."""

_MOST_AT_ONCE = 1024  # bytes; if more come before an answer, there is none
_MISSED_TO_DRAIN = 5

# A motor that lost a byte takes the following bytes for the rest of that packet. It is longest if
# the instruction of a sync write is taken for the length. These bytes end it and start no other.
_FILLER = bytes(140)
_LONGEST_FILLER = 0.005  # s
_ID, _LENGTH, _STATUS, _DATA = 2, 3, 4, 5  # places in a packet


class OpenPort(PortHandler):
    """The SDK's port handler on an open port: its reads block, its errors are PortErrors.

    A read is short only after the port's timeout, so that a packet timeout needs no clock, or
    after so many bytes since the last request that there is no answer.
    """

    def __init__(self, stream: SerialPort, clock: Callable[[], int]) -> None:
        super().__init__('')
        self.ser = stream
        self.is_open = True
        self.sent_ns = 0
        self.received_ns = 0
        self._clock = clock
        self._left = 0

    def wait_for(self, seconds: float) -> None:
        """Set the longest time that a read waits for its bytes [s]."""
        if seconds != self.ser.timeout:
            with port_errors():
                self.ser.timeout = seconds

    def clearPort(self) -> None:  # noqa: N802
        """Drop the received bytes."""
        with port_errors():
            self.ser.reset_input_buffer()

    def writePort(self, packet: list[int]) -> int | None:  # noqa: N802
        """Send a packet and store the time just before."""
        self._left = _MOST_AT_ONCE
        self.sent_ns = self._clock()
        with port_errors():
            return self.ser.write(bytes(packet))

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return `length` bytes, or fewer after the timeout; store the time just after."""
        with port_errors():
            data = self.ser.read(max(min(length, self._left), 0))
        self.received_ns = self._clock()
        self._left -= len(data)
        return data

    def drain(self) -> None:
        """Drop all bytes until none come for the longest time that a reply may take."""
        self.wait_for(LONGEST)
        self._left = _MOST_AT_ONCE
        while self._left and self.readPort(self._left):
            pass

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Return True: the SDK calls this only after a short read."""
        return True


class DynamixelBus:
    """Requests to the motor with one ID on an open port.

    Every method raises a kind of ReplyError if the motor does not answer properly, and PortError
    if the port fails.

    Parameters
    ----------
    stream
        Open port.
    servo_id, baud_rate
        ID of the motor, and bit rate of the bus [bit/s].
    clock
        Returns the host time [ns].
    """

    def __init__(
        self, stream: SerialPort, servo_id: int, baud_rate: int, clock: Callable[[], int]
    ) -> None:
        self._port = OpenPort(stream, clock)
        self._id = servo_id
        self._packets = PacketHandler(PROTOCOL)
        self._timeout = ReplyTimeout(baud_rate)
        self._filler = _FILLER[: round(_LONGEST_FILLER * baud_rate / 10)]
        self._missed = 0
        self._requests = 0

    def read(self, address: int, length: int, spare: int = 0) -> Reply:
        """Read registers in one transaction.

        Parameters
        ----------
        address, length
            Address of the first register, and number of bytes.
        spare
            Up to this many more bytes may be read. Each request after one without an answer has
            another length, so that a late reply is not taken for that of a later request. When
            no length is left, no further request is sent: the motor has to be connected again.
        """
        if spare and self._missed > spare:
            self._port.drain()
            raise NoAnswerError(f'{self._name} does not answer')
        size = length + self._requests % (spare + 1)
        packet = self._request(INST_READ, [address, size], size)
        status, data = packet[_STATUS], bytes(packet[_DATA:-1])
        if not data:
            self._check_accepted(status)
            raise CorruptReplyError(f'{self._name} sent no data')
        return Reply(data[:length], size, status, self._port.sent_ns, self._port.received_ns)

    def write(self, address: int, data: bytes) -> None:
        """Write registers and wait for the motor's confirmation."""
        packet = self._request(INST_WRITE, [address, *data], 0)
        self._check_accepted(packet[_STATUS])

    def post(self, address: int, data: bytes) -> None:
        """Write registers without confirmation (a sync write, which has no reply)."""
        block = [self._id, *data]
        try:
            result = self._packets.syncWriteTxOnly(
                self._port, address, len(data), block, len(block)
            )
        finally:
            self._port.is_using = False
        self._check(result)

    def _request(self, instruction: int, parameters: list[int], size: int) -> list[int]:
        """Send a request; return the answer, which has `size` bytes of data or none."""
        if self._missed >= _MISSED_TO_DRAIN or (self._missed and instruction == INST_WRITE):
            self._port.drain()  # all confirmations of writes are alike
        total = len(parameters) + OVERHEAD + size + OVERHEAD
        self._port.wait_for(self._timeout.seconds(total, self._missed))
        self._missed, self._requests = self._missed + 1, self._requests + 1
        header = [0xFF, 0xFF, self._id, len(parameters) + 2, instruction]
        try:
            result = self._packets.txPacket(self._port, [*header, *parameters, 0])
            self._check(result)
            packet = self._answer(size)
        except NoAnswerError:
            self._port.writePort(list(self._filler))
            raise
        finally:
            self._port.is_using = False  # the SDK leaves it set when the port raises
        self._timeout.add(total, self._port.received_ns - self._port.sent_ns)
        self._missed, self._requests = 0, self._requests - 1
        return packet

    def _answer(self, size: int) -> list[int]:
        while True:
            packet, result = self._packets.rxPacket(self._port)
            self._check(result)
            if packet[_ID] == self._id and packet[_LENGTH] in (2, size + 2):
                return list(packet)

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
