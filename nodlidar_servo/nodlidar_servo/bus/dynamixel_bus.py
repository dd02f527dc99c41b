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
    PortHandler,
)
from nodlidar_common.serial_port import port_errors, SerialPort
from nodlidar_servo.bus.packets import Answer, PacketFormat, PROTOCOL_1
from nodlidar_servo.bus.replies import (
    CorruptReplyError,
    NoAnswerError,
    RefusedError,
    Reply,
    ReplyError,
)
from nodlidar_servo.bus.reply_timeout import LONGEST_REPLY, ReplyTimeout

INST_REBOOT = 8  # of Protocol 2.0 only

_MOST_AT_ONCE = 1024  # bytes; if more come before an answer, there is none
_MISSED_TO_DRAIN = 5

# A motor that lost a byte takes the following bytes for the rest of that packet. It is longest if
# the instruction of a sync write is taken for the length. These bytes end it and start no other.
_FILLER = bytes(140)
_LONGEST_FILLER = 0.005  # s


class SdkPort(PortHandler):
    """The SDK's port handler on an open port: its reads block, its errors are PortErrors.

    A read is short only after the port's timeout, so that a packet timeout needs no clock, or
    after so many bytes since the last request that there is no answer.

    Attributes
    ----------
    expected
        Bytes of the answer that have not come. They are read at once, though the SDK asks for them
        in two pieces.
    """

    def __init__(self, stream: SerialPort, clock: Callable[[], int]) -> None:
        super().__init__('')
        self.ser = stream
        self.is_open = True
        self.sent_ns = 0
        self.received_ns = 0
        self.expected = 0
        self._clock = clock
        self._left = 0
        self._read = b''

    def wait_for(self, seconds: float) -> None:
        """Set the longest time that a read waits for its bytes [s]."""
        if seconds != self.ser.timeout:
            with port_errors():
                self.ser.timeout = seconds

    def clearPort(self) -> None:  # noqa: N802
        """Drop the received bytes."""
        self._read = b''
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
        missing = length - len(self._read)
        if missing > 0:
            with port_errors():
                data = self.ser.read(max(min(max(missing, self.expected), self._left), 0))
            self.received_ns = self._clock()
            self._left -= len(data)
            self.expected = max(self.expected - len(data), 0)
            self._read += data
        taken, self._read = self._read[:length], self._read[length:]
        return taken

    def drain(self) -> None:
        """Drop all bytes until none come for the longest time that a reply may take."""
        self.wait_for(LONGEST_REPLY)
        self._left, self._read = _MOST_AT_ONCE, b''
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
    packets
        The version of the protocol.
    """

    def __init__(
        self,
        stream: SerialPort,
        servo_id: int,
        baud_rate: int,
        clock: Callable[[], int],
        packets: PacketFormat = PROTOCOL_1,
    ) -> None:
        self._port = SdkPort(stream, clock)
        self._id = servo_id
        self._packets = packets
        self._timeout = ReplyTimeout(baud_rate)
        self._filler = _FILLER[: round(_LONGEST_FILLER * baud_rate / 10)]
        self._missed = 0
        self._unanswered = 0

    def read(self, address: int, length: int, spare: int = 0) -> Reply:
        """Read registers in one transaction.

        Parameters
        ----------
        address, length
            Address of the first register, and number of bytes.
        spare
            Up to this many bytes before them may be read, too. Each request after one without an
            answer has another length, so that a late reply is not taken for that of a later
            request. When no length is left, no further request is sent: the motor has to be
            connected again.
        """
        if spare and self._missed > spare:
            self._port.drain()
            raise NoAnswerError(f'{self._name} does not answer')
        more = self._unanswered % (spare + 1)
        size = length + more
        number = self._packets.number
        parameters = number(address - more) + number(size)
        answer = self._request(INST_READ, parameters, size)
        if not answer.data:
            self._check_accepted(answer.status)
            raise CorruptReplyError(f'{self._name} sent no data')
        return Reply(
            answer.data[more:],
            len(parameters) + self._packets.request_overhead,
            size + self._packets.answer_overhead,
            answer.status,
            self._port.sent_ns,
            self._port.received_ns,
        )

    def write(self, address: int, data: bytes) -> None:
        """Write registers and wait for the motor's confirmation."""
        answer = self._request(INST_WRITE, self._packets.number(address) + data, 0)
        self._check_accepted(answer.status)

    def reboot(self) -> None:
        """Start the motor anew, which Protocol 2.0 can: it then has no alarms and no torque."""
        self._request(INST_REBOOT, b'', 0)

    def post(self, address: int, data: bytes) -> None:
        """Write registers without confirmation (a sync write, which has no reply)."""
        block = [self._id, *data]
        try:
            result = self._packets.handler.syncWriteTxOnly(
                self._port, address, len(data), block, len(block)
            )
        finally:
            self._port.is_using = False
        self._check(result)

    def _request(self, instruction: int, parameters: bytes, size: int) -> Answer:
        """Send a request; return the answer, which has `size` bytes of data or none."""
        if self._missed >= _MISSED_TO_DRAIN or (self._missed and instruction == INST_WRITE):
            self._port.drain()  # all confirmations of writes are alike
        overhead = self._packets.request_overhead + self._packets.answer_overhead
        total = len(parameters) + size + overhead
        self._port.wait_for(self._timeout.seconds(total, self._missed))
        self._missed, self._unanswered = self._missed + 1, self._unanswered + 1
        packet = self._packets.request(self._id, instruction, parameters)
        self._port.expected = size + self._packets.answer_overhead
        try:
            self._check(self._packets.handler.txPacket(self._port, packet))
            answer = self._answer(size)
        except NoAnswerError:
            self._port.writePort(list(self._filler))
            raise
        finally:
            self._port.is_using = False  # the SDK leaves it set when the port raises
        if len(answer.data) == size:  # else the rest of an answer was waited for
            self._timeout.add(total, self._port.received_ns - self._port.sent_ns)
        self._missed, self._unanswered = 0, self._unanswered - 1
        return answer

    def _answer(self, size: int) -> Answer:
        while True:
            packet, result = self._receive()
            self._check(result)
            answer = self._packets.answer(packet)
            if answer.servo_id == self._id and len(answer.data) in (0, size):
                return answer

    def _receive(self) -> tuple[list[int], int]:
        handler = self._packets.handler
        if self._packets.version == 1.0:
            return handler.rxPacket(self._port)  # type: ignore[no-any-return]
        return handler.rxPacket(self._port, False)  # type: ignore[no-any-return]

    def _check(self, result: int) -> None:
        if result == COMM_RX_TIMEOUT:
            raise NoAnswerError(f'{self._name} does not answer')
        if result == COMM_RX_CORRUPT:
            raise CorruptReplyError(f'{self._name} sent a corrupt reply')
        if result != COMM_SUCCESS:
            raise ReplyError(f'{self._name}: {self._packets.handler.getTxRxResult(result)}')

    def _check_accepted(self, status: int) -> None:
        if refusal := self._packets.refusal(status):
            raise RefusedError(f'{self._name} refused the request: {refusal}')

    @property
    def _name(self) -> str:
        return f'the servo with ID {self._id}'
