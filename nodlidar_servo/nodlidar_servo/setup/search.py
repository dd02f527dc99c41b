"""Finds servos on a bus: at every bit rate that they can have, with every ID, of both protocols.

A ping goes to all IDs at once. Servos of Protocol 1.0 answer it at the same time: where that gives
only noise, each ID is asked alone. Those of 2.0 answer one after the other, up to 3 ms per ID
later (ROBOTIS e-manual, Ping; the SDK waits as long). Bit rates are those of the manuals; 1.0 has
2 Mbit/s / (n + 1) for any n up to 254, which `rare_rates` lists as densely as a UART needs.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
import re

from nodlidar_common.serial_port import port_errors, SerialPort
from nodlidar_servo.bus.packets import Answer, PacketFormat, PROTOCOL_1, PROTOCOL_2
from nodlidar_servo.setup.errors import LidarError

OpenAt = Callable[[int], AbstractContextManager[SerialPort]]
"""Opens the port at a bit rate [bit/s]."""

RATES_1 = (
    *(1_000_000, 57_600, 115_200, 500_000, 250_000, 400_000, 200_000, 19_200, 9600),
    *(128_000, 76_800, 38_400),  # of STS servos
)
RATES_2 = (1_000_000, 57_600, 115_200, 2_000_000, 3_000_000, 4_000_000, 4_500_000, 9600)
PING, READ, WRITE = 1, 2, 3
BROADCAST, LAST_ID = 0xFE, 252

_BYTES = 4096
_WAIT = 0.045  # s; a reply, with an adapter that holds it back for 16 ms
_LATER = {1.0: 0.0, 2.0: 0.76}  # s; the last reply to a ping of all, at 3 ms per ID
OVERHEADS, _PING_DATA = 32, 3  # bytes of request and reply, at most; of a ping's reply
_SPACING = 0.02  # of bit rates; a UART bears more
_REPEATS = 4
_LISTENING_RATE, _LISTENED = 115_200, 0.15  # bit/s, any does; s, longer than a revolution
_STREAM = 64  # bytes that nobody asked for; what is left of a reply is less


@dataclass(frozen=True, slots=True)
class Found:
    """A servo that answered.

    Attributes
    ----------
    packets
        Its protocol.
    baud_rate
        Bit rate [bit/s].
    servo_id
        Its ID.
    """

    packets: PacketFormat
    baud_rate: int
    servo_id: int


@dataclass(frozen=True, slots=True)
class Trial:
    """One bit rate and protocol to be tried."""

    packets: PacketFormat
    baud_rate: int


def usual_trials() -> list[Trial]:
    """Return the bit rates of the manuals, the most likely first."""
    rates = list(dict.fromkeys((*RATES_2, *RATES_1)))
    both = ((PROTOCOL_2, RATES_2), (PROTOCOL_1, RATES_1))
    return [Trial(packets, rate) for rate in rates for packets, own in both if rate in own]


def rare_trials() -> list[Trial]:
    """Return the other bit rates that servos of Protocol 1.0 can have."""
    return [Trial(PROTOCOL_1, rate) for rate in rare_rates()]


def rare_rates() -> list[int]:
    """Return bit rates of Protocol 1.0 that are not usual, each within 2 % of the next."""
    rates = [3_000_000, 2_500_000, 2_250_000]  # of an MX-28
    last = float('inf')
    for n in range(255):
        rate = 2_000_000 / (n + 1)
        usual = any(abs(rate / known - 1.0) < _SPACING for known in RATES_1)
        if not usual and rate <= last * (1.0 - _SPACING):
            rates.append(round(rate))
            last = rate
    return rates


def search(open_at: OpenAt, trials: Iterable[Trial]) -> Iterator[list[Found]]:
    """Yield after each trial which servos answered; IDs are asked one by one after noise.

    Raises
    ------
    LidarError
        If something streams there.
    PortError
        If the port cannot be used.
    """
    with open_at(_LISTENING_RATE) as port:
        if streams(port):
            raise LidarError(
                'something streams at this port, so it is no servo, but perhaps a lidar such as an'
                ' LD19: --port is that of the servo (`ls -l /dev/serial/by-id` shows which)'
            )
    for trial in trials:
        with open_at(trial.baud_rate) as port:
            servo_ids = _all_ids(port, trial)
        yield [Found(trial.packets, trial.baud_rate, servo_id) for servo_id in servo_ids]


def streams(port: SerialPort) -> bool:
    """Return whether bytes come that nobody asked for; servos send none."""
    with port_errors():
        port.reset_input_buffer()
        port.timeout = _LISTENED
        return len(port.read(_STREAM)) == _STREAM


def answers(packets: PacketFormat, received: bytes) -> list[Answer]:
    """Return the sound status packets among received bytes."""
    pattern, extra = (_STATUS_2, 7) if packets is PROTOCOL_2 else (_STATUS_1, 4)
    found = []
    for match in pattern.finditer(received):
        end = match.start() + extra + int.from_bytes(match[1], 'little')
        packet = received[match.start() : end]
        if end <= len(received) and packet == packets.sealed(packet):
            found.append(packets.answer(packet))
    return found


def exchange(
    port: SerialPort,
    packets: PacketFormat,
    request: tuple[int, int, bytes],
    wait: float,
    size: int = _BYTES,
) -> bytes:
    """Send a request other than a ping; return what comes back, without an adapter's echo.

    The echo of a ping of one ID may be the reply of a servo.

    Parameters
    ----------
    port, packets
        Open at the servo's bit rate; the protocol.
    request
        ID, instruction and parameters.
    wait, size
        The reply ends after so long [s], or earlier with so many bytes.
    """
    sent = packets.encode(*request)
    received = _exchanged(port, sent, wait, size)
    echoes = received and received[: len(sent)] == sent[: len(received)]
    if echoes and len(received) == size:
        with port_errors():
            received += port.read(len(sent))
    return received.removeprefix(sent) if echoes else received


def _exchanged(port: SerialPort, sent: bytes, wait: float, size: int = _BYTES) -> bytes:
    """Send bytes; return what comes back."""
    with port_errors():
        port.reset_input_buffer()
        port.timeout = wait
        port.write(sent)
        return port.read(size)


def reply_wait(baud_rate: int, size: int) -> float:
    """Return how long a request and its reply may take [s], of `size` bytes together."""
    return _WAIT + size * 10.0 / baud_rate


def is_shared(port: SerialPort, found: Found, address: int, size: int) -> bool:
    """Return whether two servos answer to one ID: replies double, or broken half of the time.

    They differ in what they measure, so their replies to a read differ. A bad cable looks alike.

    Parameters
    ----------
    port
        Open at the servo's bit rate.
    found
        The servo.
    address, size
        Of the registers with what it measures.
    """
    packets = found.packets
    request = found.servo_id, READ, packets.number(address) + packets.number(size)
    wait, whole = reply_wait(found.baud_rate, size + OVERHEADS), size + packets.answer_overhead
    odd = missed = 0
    for _ in range(_REPEATS):
        received = exchange(port, packets, request, wait)
        sound = answers(packets, received)
        if len(sound) > 1 + missed:  # those that were missed come late, from a busy host
            return True
        odd += bool(received) and not (sound and len(received) == len(sound) * whole)
        missed = 0 if received else missed + 1
    return 2 * odd >= _REPEATS


_STATUS_1 = re.compile(rb'(?=\xff\xff[\x00-\xfc]([\x02-\xff]))', re.DOTALL)
_STATUS_2 = re.compile(rb'(?=\xff\xff\xfd\x00[\x00-\xfc](..)\x55)', re.DOTALL)


def _all_ids(port: SerialPort, trial: Trial) -> Sequence[int]:
    packets = trial.packets
    wait = reply_wait(trial.baud_rate, OVERHEADS) + _LATER[packets.version]
    ping = packets.encode(BROADCAST, PING, b'')
    received = _exchanged(port, ping, wait)
    echoes = received.startswith(ping)  # as no servo has this ID
    received = received.removeprefix(ping)
    found = sorted({answer.servo_id for answer in answers(packets, received)})
    size = packets.answer_overhead + (_PING_DATA if packets is PROTOCOL_2 else 0)
    if len(received) <= len(found) * size or not _is_noise_of_servos(received):
        return found
    return sorted({*found, *_one_by_one(port, trial, echoes)})


def _is_noise_of_servos(received: bytes) -> bool:
    """Return whether broken replies came: they have high bits, the text of a lidar has none."""
    return any(byte >= 0x80 for byte in received)


def _one_by_one(port: SerialPort, trial: Trial, echoes: bool) -> Iterator[int]:
    """Yield the IDs that answer when asked alone, also with noise: then two have that ID."""
    wait = reply_wait(trial.baud_rate, OVERHEADS)
    for servo_id in range(LAST_ID + 1):
        ping = trial.packets.encode(servo_id, PING, b'')
        if _exchanged(port, ping, wait).removeprefix(ping if echoes else b''):
            yield servo_id
