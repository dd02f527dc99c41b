"""Asks what is at a port that nobody uses: a lidar for its version, a servo by a ping.

Neither moves anything. A ping goes to all IDs, in Protocol 1.0 and 2.0 (ROBOTIS e-Manual,
"DYNAMIXEL Protocol 1.0" and "2.0", Ping and Status Packet), at each usual bit rate; `VV` is SCIP
2.0 (C-42-03320B).
"""

from collections.abc import Callable
import re

from nodlidar_bringup.checks.ports import Answer, LIDAR, Port, SERVO
from nodlidar_common.errors import PortError
from nodlidar_common.serial_port import close_port, open_port, port_errors

BIT_RATES = (1_000_000, 57_600, 115_200, 2_000_000, 3_000_000, 4_000_000)
PING_1 = bytes((0xFF, 0xFF, 0xFE, 0x02, 0x01, 0xFE))
PING_2 = bytes((0xFF, 0xFF, 0xFD, 0x00, 0xFE, 0x03, 0x00, 0x01, 0x31, 0x42))
_STATUS_1 = re.compile(rb'\xff\xff([\x00-\xfc])(.)(.)', re.DOTALL)
_STATUS_2 = re.compile(rb'\xff\xff\xfd\x00([\x00-\xfc])\x07\x00\x55.(..)', re.DOTALL)
_LIDAR_WAIT, _SERVO_WAIT = 0.35, 0.04  # s; a lidar answers once a revolution
_MODELS = {
    **{12: 'AX-12A', 18: 'AX-18A', 24: 'RX-24F', 28: 'RX-28', 29: 'MX-28', 64: 'RX-64'},
    **{30: 'MX-28', 1060: 'XL430-W250', 1190: 'XL330-M077', 1200: 'XL330-M288'},
}


def ask(port: Port) -> Answer | None:
    """Return what answers at a port; None if it may not be asked, because it cannot be opened."""
    first, then = (_ask_lidar, _ask_servo) if port.device == LIDAR else (_ask_servo, _ask_lidar)
    try:
        return first(port.path) or then(port.path) or Answer()
    except PortError:
        return None


def _ask_lidar(path: str) -> Answer | None:
    reply = _exchange(path, 115_200, b'\nQT\nVV\n', _LIDAR_WAIT, lambda got: b'SERI:' in got)
    if match := re.search(rb'PROD:([^;\n]*)', reply):
        return Answer(LIDAR, match[1].decode('ascii', 'replace'))
    return Answer(LIDAR, 'a lidar with SCIP 1.1') if b'QT\n' in reply else None


def _ask_servo(path: str) -> Answer | None:
    """Return the answer to a ping at the first bit rate at which there is one."""
    for rate in BIT_RATES:
        reply = _exchange(path, rate, PING_2, _SERVO_WAIT, _STATUS_2.search)
        if match := _STATUS_2.search(reply):
            number = int.from_bytes(match[2], 'little')
            return Answer(SERVO, _MODELS.get(number, f'model {number}'), rate, match[1][0])
        reply = _exchange(path, rate, PING_1, _SERVO_WAIT, _status_1)
        if status := _status_1(reply):
            return _registers(path, rate, status[0])
    return None


def _registers(path: str, rate: int, servo_id: int) -> Answer:
    """Return model and angle limits of a servo of Protocol 1.0: registers 0, and 6 to 9."""
    body = bytes((servo_id, 4, 2, 0, 10))
    request = b'\xff\xff' + body + bytes((~sum(body) & 0xFF,))
    status = _status_1(_exchange(path, rate, request, _SERVO_WAIT, _has_registers))
    data = status[1] if status else b''
    if len(data) < 10:
        return Answer(SERVO, 'a servo', rate, servo_id)
    number, low, high = (int.from_bytes(data[at : at + 2], 'little') for at in (0, 6, 8))
    return Answer(SERVO, _MODELS.get(number, f'model {number}'), rate, servo_id, (low, high))


def _has_registers(received: bytes) -> bool:
    status = _status_1(received)
    return status is not None and len(status[1]) == 10


def _status_1(received: bytes) -> tuple[int, bytes] | None:
    """Return ID and data of the first status packet with the right checksum."""
    for match in _STATUS_1.finditer(received):
        end = match.start() + 4 + match[2][0]
        packet = received[match.start() : end]
        complete = len(packet) >= 6 and len(packet) == end - match.start()
        if complete and packet[-1] == ~sum(packet[2:-1]) & 0xFF:
            return packet[2], packet[5:-1]
    return None


def _exchange(
    path: str, rate: int, request: bytes, wait: float, complete: Callable[[bytes], object]
) -> bytes:
    """Send a request; return what comes back until it is complete or nothing more comes."""
    port = open_port(path, rate, wait)
    try:
        with port_errors():
            port.reset_input_buffer()
            port.write(request)
            received = b''
            while not complete(received):
                more = port.read(max(1, port.in_waiting))
                if not more or len(received) > 65536:
                    break
                received += more
        return received
    finally:
        close_port(port)
