"""Reads and writes of one Dynamixel bus, through the Dynamixel SDK on a port that is open.

The SDK's packet handler builds and parses the packets. Its port handler is replaced: that one
opens the port unlocked and polls it at full speed while it waits. Its read calls are not used: on
a reply without data they raise IndexError, on a short one they take the checksum for data, and a
late reply is an answer to them whatever was asked since.
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

_MOST_AT_ONCE = 1024  # bytes; a bus on which more comes before an answer has none to give
_MISSED_TO_DRAIN = 5

# A motor that lost a byte takes what follows for the rest of a packet, of which a sync write's
# instruction, taken for the length, makes the longest. These bytes end it; they begin no other.
_FILLER = bytes(140)
_LONGEST_FILLER = 0.005  # s
_ID, _LENGTH, _STATUS, _DATA = 2, 3, 4, 5  # places in a packet


class OpenPort(PortHandler):
    """The SDK's port handler on an open port: its reads block, its errors are PortErrors.

    A read comes back short only when the port's timeout has passed, so that a packet timeout
    needs no clock; and when so much came since the last request that it is no answer.
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
        """Have each read end after a time without the bytes that it waits for [s]."""
        if seconds != self.ser.timeout:
            with port_errors():
                self.ser.timeout = seconds

    def clearPort(self) -> None:  # noqa: N802
        """Drop what has arrived."""
        with port_errors():
            self.ser.reset_input_buffer()

    def writePort(self, packet: list[int]) -> int | None:  # noqa: N802
        """Send a packet and keep the time just before."""
        self._left = _MOST_AT_ONCE
        self.sent_ns = self._clock()
        with port_errors():
            return self.ser.write(bytes(packet))

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return `length` bytes, or fewer if the timeout passes, and keep the time just after."""
        with port_errors():
            data = self.ser.read(max(min(length, self._left), 0))
        self.received_ns = self._clock()
        self._left -= len(data)
        return data

    def drain(self) -> None:
        """Drop what comes until nothing does for the longest time that a reply may take."""
        self.wait_for(LONGEST)
        self._left = _MOST_AT_ONCE
        while self._left and self.readPort(self._left):
            pass

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Tell that time is up: the SDK asks only after a short read."""
        return True


class DynamixelBus:
    """Requests to the motor with one ID on an open port.

    Every method raises ReplyError (one of its kinds) if the motor does not answer as it should,
    and PortError if the port goes away.

    Parameters
    ----------
    stream
        Open port.
    servo_id, baud_rate
        The motor's ID, and the rate of its bus [bit/s].
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
            The first register, and how many bytes are wanted.
        spare
            Up to so many more may be read. Each request after one without answer asks for another
            length, so that a reply that comes late is not taken for that of a later request. When
            every length was asked for in vain nothing more is: the motor has to be connected anew.
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
        """Write registers and wait until the motor confirms."""
        packet = self._request(INST_WRITE, [address, *data], 0)
        self._check_accepted(packet[_STATUS])

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

    def _request(self, instruction: int, parameters: list[int], size: int) -> list[int]:
        """Return the packet that answers a request with so much data, or with none."""
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
