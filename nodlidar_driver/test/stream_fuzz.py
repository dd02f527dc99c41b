"""A recorded session with a lidar whose answers are damaged, some with their sums made right."""

from contextlib import suppress

from lidar_rig import START_NS
from nodlidar_common import scip
from nodlidar_common.errors import DeviceError
from nodlidar_driver.scip.lidar import Lidar
from nodlidar_driver.scip.scan_account import ScanAccount
from nodlidar_driver.scip.scan_window import ScanWindow
from nodlidar_driver.scip.scip_port import ScipPort
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.ports.virtual_port import VirtualClock, VirtualPort
import numpy as np

WINDOW = ScanWindow(360, 409, 1, 0)
SCANS = 8
TURN_NS = 100_000_000


def recorded_session():
    """Return what the lidar sends, message by message, from QT to some scans."""
    clock = VirtualClock(START_NS)
    emulator = UrgEmulator(lambda times_ns, azimuth: 2.0 + azimuth, start_ns=START_NS)
    port = VirtualPort(emulator, clock, 1.0)
    received, read = bytearray(), port.read

    def read_and_record(size=1):
        data = read(size)
        received.extend(data)
        return data

    port.read = read_and_record
    lidar = Lidar(ScipPort(port, clock, 1.0), lambda _: WINDOW, ScanAccount())
    lidar.connect()
    for _ in range(SCANS):
        lidar.read()
    return [message + b'\n\n' for message in bytes(received).split(b'\n\n')[:-1]]


def _cut(message, place, value):
    return message[:place]


def _lose(message, place, value):
    return message[:place] + message[place + 1 :]


def _insert(message, place, value):
    return message[:place] + bytes([value]) + message[place:]


def _line_feed(message, place, value):
    return message[:place] + b'\n' + message[place:]


def _flip(message, place, value):
    return message[:place] + bytes([message[place] ^ (value or 1)]) + message[place + 1 :]


def _repeat(message, place, value):
    return message + message[place:]


def _lose_line(message, place, value):
    lines = message.split(b'\n')
    del lines[place % len(lines)]
    return b'\n'.join(lines)


def _lie(message, place, value):
    """Change a character of a line and make its sum right."""
    lines = message.split(b'\n')
    at = min(1 + place % max(len(lines) - 3, 1), len(lines) - 1)
    line = lines[at]
    if len(line) > 1:
        body = line[:-2] if line[-2:-1] == b';' else line[:-1]
        where = value % len(body) if body else 0
        body = body[:where] + bytes([0x30 + value % 64]) + body[where + 1 :]
        lines[at] = body + line[len(body) : -1] + scip.checksum(body)
    return b'\n'.join(lines)


def _lengthen(message, place, value):
    """Make a line absurdly long, with a right sum."""
    lines = message.split(b'\n')
    at = min(1 + place % max(len(lines) - 3, 1), len(lines) - 1)
    body = lines[at][:-1] + bytes([0x30 + value % 10]) * 6000
    lines[at] = scip.add_sum(body)
    return b'\n'.join(lines)


MUTATIONS = (
    _cut, _lose, _insert, _line_feed, _flip, _repeat, _lose_line, _lie, _lie, _lie, _lengthen,
)  # fmt: skip


class DamagedLidar:
    """A port with a session's messages, of which some are damaged; an empty read is a timeout.

    Parameters
    ----------
    session
        What the lidar sends.
    damage
        Number of a message, of a kind of damage, its place and a value, each.
    turn_ns
        Host time that passes with each read [ns].
    """

    def __init__(self, session, damage, turn_ns=TURN_NS):
        self.timeout = None
        self.now_ns = START_NS
        self._turn_ns = turn_ns
        messages = list(session)
        for number, kind, place, value in damage:
            number %= len(messages)
            message = messages[number] or b'\n'
            messages[number] = MUTATIONS[kind % len(MUTATIONS)](
                message, place % len(message), value
            )
        self._messages = messages[::-1]
        self._waiting = b''

    def clock(self):
        return self.now_ns

    @property
    def in_waiting(self):
        return len(self._waiting)

    def read(self, size=1):
        if not self._waiting and size:
            self.now_ns += self._turn_ns
            self._waiting = self._messages.pop() if self._messages else b''
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data

    def write(self, data):
        return len(data)


def use(port):
    """Use a lidar until it fails in a way that the node knows; return its account."""
    account = ScanAccount()
    lidar = Lidar(ScipPort(port, port.clock, 1.0), lambda _: WINDOW, account)
    with suppress(DeviceError):
        lidar.connect()
        while True:
            scan = lidar.read()
            assert np.isfinite(scan.revolution)
            assert len(scan.ranges) == WINDOW.count
    with suppress(DeviceError):
        lidar.disconnect()
    assert account.due == account.published + account.lost.total()
    assert min(account.lost.values()) >= 0
    return account
