"""The line between two machines does what it says: losses, delay, order, fragments."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
import socket
import time

import numpy as np
import pytest

from bench.network.machines import Line, Machines, NoRightsError

ADDRESS = '10.77.0.1', 5000


@pytest.fixture(scope='module')
def machines() -> Iterator[Machines]:
    try:
        made = Machines(Line())
    except NoRightsError as error:
        pytest.skip(f'not the line itself, which the tests of nodes do not use then: {error}')
    with made:
        yield made


@pytest.fixture
def ends(machines: Machines) -> Iterator[tuple[socket.socket, socket.socket]]:
    """Return a socket on each machine, from the far one to the robot."""
    machines.line = Line()
    udp = lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM)  # noqa: E731
    with machines.robot.run(udp) as here, machines.far.run(udp) as there:
        here.bind(ADDRESS)
        here.settimeout(0.4)
        there.sendto(b'who are you', ADDRESS)  # ARP: the first packet waits for the answer
        here.recv(100)
        yield here, there


def sent_over(ends, count: int, size: int, period: float = 0.001):
    """Return when datagrams were sent, and when and which of them arrived."""
    here, there = ends
    with ThreadPoolExecutor(1) as thread:
        found = thread.submit(arrivals, here)
        return send(there, count, size, period), found.result()


def arrivals(here: socket.socket) -> list[tuple[float, int]]:
    """Return when each datagram arrived and its number, until none comes any more."""
    found = []
    try:
        while True:
            data = here.recv(65536)
            found.append((time.monotonic(), int.from_bytes(data[:4], 'little')))
    except TimeoutError:
        return found


def send(there: socket.socket, count: int, size: int, period: float) -> list[float]:
    sent = []
    for number in range(count):
        sent.append(time.monotonic())
        there.sendto(number.to_bytes(4, 'little') + bytes(size - 4), ADDRESS)
        time.sleep(period)
    return sent


def test_datagrams_are_late_by_delay_and_jitter_and_in_order(machines, ends):
    machines.line = Line(delay=0.05, jitter=0.03)
    sent, found = sent_over(ends, 40, 100, period=0.005)
    assert [number for _, number in found] == list(range(40))
    late = np.array([at for at, _ in found]) - sent
    assert late.min() >= 0.05
    assert 0.055 < np.median(late) < 0.1


def test_one_lost_fragment_loses_a_datagram(machines, ends):
    """Of 8 fragments each, (1 - p)^8 of the datagrams arrive: a closed form."""
    loss, count, fragments = 0.1, 300, 8
    machines.line, before = Line(loss=loss), machines.lost[1]
    _, found = sent_over(ends, count, fragments * 1480 - 8)
    expected = count * (1.0 - loss) ** fragments
    spread = np.sqrt(expected * (1.0 - (1.0 - loss) ** fragments))
    assert abs(len(found) - expected) < 4.0 * spread
    lost, frames = machines.lost[1] - before, count * fragments
    assert abs(lost - loss * frames) < 4.0 * np.sqrt(frames * loss)


def test_a_line_that_loses_nothing_loses_nothing(machines, ends):
    lost = list(machines.lost)
    _, found = sent_over(ends, 50, 4000)
    assert len(found) == 50
    assert machines.lost == lost
