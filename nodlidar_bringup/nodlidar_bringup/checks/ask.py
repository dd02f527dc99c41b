"""Asks what is at a port that nobody uses: a lidar for its version, a servo by a ping.

Neither moves anything. What sends without being asked is a lidar with a driver of its own, unless
it answers `VV` of SCIP 2.0 (C-42-03320B): then it was left measuring. A ping goes to the ID of the
servo's node and to all IDs, in Protocol 1.0 and 2.0 (ROBOTIS e-Manual, "DYNAMIXEL Protocol 1.0"
and "2.0", Ping and Status Packet), at each usual bit rate.
"""

from collections.abc import Callable
from functools import partial
from itertools import product
import re
import time

from nodlidar_bringup.checks.ports import Answer, LIDAR, Port, SERVO, ServoSettings
from nodlidar_common.errors import PortError
from nodlidar_common.serial_port import close_port, open_port, port_errors, TCP
from nodlidar_servo.bus.packets import Answer as ServoAnswer
from nodlidar_servo.bus.packets import PacketFormat, PROTOCOL_1, PROTOCOL_2
from nodlidar_servo.models.models import MODELS
from nodlidar_servo.setup.registers import HEAD, protocol_of, registers_of
from nodlidar_servo.setup.search import answers, BROADCAST, PING, READ, streams

BIT_RATES = (1_000_000, 57_600, 115_200, 2_000_000, 3_000_000, 4_000_000)
_LIDAR_WAIT = 2.0  # s; it answers once a revolution, to each command; a busy computer is late
# For a servo [s]: longer if none answers at first.
_SERVO_WAIT, _SERVO_PATIENCE = 0.04, 0.2
_LIDAR_RATE = 115_200
_NAMES = {model.number: model.name for model in MODELS.values()}


def ask(port: Port, servo_id: int = ServoSettings.servo_id) -> Answer | None:
    """Return what answers at a port; None if it may not be asked, because it cannot be opened.

    Of several servos on a bus it is the one with an ID, if that answers.
    At a TCP address only its own device is looked for: nothing answers if it takes no connection.
    """
    ask_servo = partial(_ask_servo, servo_id=servo_id)
    first, then = (_ask_lidar, ask_servo) if port.device == LIDAR else (ask_servo, _ask_lidar)
    if port.path.startswith(TCP):
        try:
            return first(port.path) or Answer()
        except PortError:
            return Answer()
    try:
        if _streams(port.path):
            return _ask_lidar(port.path) or Answer(LIDAR, streams=True)
        return first(port.path) or then(port.path) or Answer()
    except PortError:
        return None


def _streams(path: str) -> bool:
    port = open_port(path, _LIDAR_RATE, None)
    try:
        return streams(port)
    finally:
        close_port(port)


def _ask_lidar(path: str) -> Answer | None:
    reply = _exchange(path, _LIDAR_RATE, b'\nQT\nVV\n', _LIDAR_WAIT, lambda got: b'SERI:' in got)
    if match := re.search(rb'PROD:([^;\n]*)', reply):
        return Answer(LIDAR, match[1].decode('ascii', 'replace'))
    return Answer(LIDAR, 'a lidar with SCIP 1.1') if b'QT\n' in reply else None


def _ask_servo(path: str, servo_id: int) -> Answer | None:
    """Return the answer to a ping at the first bit rate at which there is one.

    The ID comes first: to a broadcast, all servos of Protocol 1.0 would answer at once.
    """
    for wait, rate in product((_SERVO_WAIT, _SERVO_PATIENCE), BIT_RATES):
        for packets, asked in product((PROTOCOL_2, PROTOCOL_1), (servo_id, BROADCAST)):
            if found := _request(path, rate, packets, (asked, PING, b''), wait):
                return _registers(path, rate, packets, *found)
    return None


def _registers(path: str, rate: int, packets: PacketFormat, servo_id: int, data: bytes) -> Answer:
    """Return the model of a servo, and why it cannot be positioned, by its registers.

    If it does not answer, return its model by its answer to the ping: Protocol 2.0 has it there.
    """
    number = packets.number
    if head := _request(path, rate, packets, (servo_id, READ, number(0) + number(HEAD))):
        packets = protocol_of(packets, head[1])
    table = registers_of(packets)
    request = servo_id, READ, number(0) + number(table.set_up_size)
    found = _request(path, rate, packets, request)
    if found is None or len(found[1]) != table.set_up_size:
        return Answer(SERVO, _model(int.from_bytes(data[:2], 'little')), rate, servo_id)
    values = table.values(found[1])
    wrong = table.wrong_mode(values)
    return Answer(SERVO, _model(values['model number']), rate, servo_id, wrong)


def _model(number: int) -> str:
    return _NAMES.get(number, f'model {number}' if number else 'a servo')


def _request(
    path: str,
    rate: int,
    packets: PacketFormat,
    request: tuple[int, int, bytes],
    wait: float = _SERVO_PATIENCE,
) -> tuple[int, bytes] | None:
    """Return ID and data of the first sound answer to a request, None if there is none.

    What the adapter may echo of the request is no answer.
    """
    sent = packets.encode(*request)

    def found_in(received: bytes) -> list[ServoAnswer]:
        return answers(packets, received.removeprefix(sent))

    found = found_in(_exchange(path, rate, sent, wait, found_in))
    return (found[0].servo_id, found[0].data) if found else None


def _exchange(
    path: str, rate: int, request: bytes, wait: float, complete: Callable[[bytes], object]
) -> bytes:
    """Send a request; return what comes back until it is complete, for some time [s] at most."""
    port = open_port(path, rate, None)
    try:
        with port_errors():
            port.reset_input_buffer()
            port.write(request)
            received, end, left = b'', time.monotonic() + wait, wait
            # Once more at the end: if the computer was busy, what came in time still waits.
            while left > 0.0 and not complete(received):
                port.timeout = left = max(0.0, end - time.monotonic())
                received += port.read(max(1, port.in_waiting))
        return received
    finally:
        close_port(port)
