"""The guard of a device, whose node is a process of its own that ends in one way or another."""

import os
import re
import select
import signal
import subprocess
import sys
import time
import tty

from nodlidar_common.guard_process import (
    ANSWER_TIMEOUT,
    ATTEMPTS,
    LAUNCH,
    LONGEST_ATTEMPT,
    switch_off,
)
import pytest

LONGEST = 20.0  # s; only a failing test waits so long
NODE = """
import os, signal, sys
from nodlidar_common.guard import Guard, StopRequest
guard = Guard(int(sys.argv[1]), StopRequest('motor', b'OFF', b'O[Kk]'))
print(guard._process.pid, flush=True)
for order in sys.stdin:
    exec(order)
"""


class Device:
    """The device's end of a pseudo-terminal."""

    def __init__(self):
        self.master, self.port = os.openpty()
        tty.setraw(self.port)
        self.received = b''

    def wait_for(self, data):
        """Read until some bytes have come."""
        deadline = time.monotonic() + LONGEST
        while data not in self.received:
            assert time.monotonic() < deadline, f'no {data!r} in {self.received!r}'
            if select.select([self.master], [], [], 0.1)[0]:
                self.received += os.read(self.master, 100)


@pytest.fixture
def device():
    device = Device()
    yield device
    os.close(device.master)
    os.close(device.port)


@pytest.fixture
def launch(monkeypatch):
    """Start a process that the node has to end with."""
    with subprocess.Popen(['sleep', '600']) as process:
        monkeypatch.setenv(LAUNCH, str(process.pid))
        yield process
        process.kill()


@pytest.fixture
def node(device):
    """Start a process that has a guard; it does what it reads, a line of Python at a time."""
    with subprocess.Popen(
        [sys.executable, '-c', NODE, str(device.port)],
        pass_fds=[device.port],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        process.guard = int(process.stdout.readline())
        yield process
        process.kill()


def order(node, line):
    node.stdin.write(f'{line}\n')
    node.stdin.flush()


@pytest.mark.parametrize('end', [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM])
def test_a_killed_node_s_device_is_stopped_until_it_confirms(device, node, end):
    node.send_signal(end)
    device.wait_for(b'OFFOFF')  # the first request was not answered
    os.write(device.master, b'noise OK')
    assert 'the node ended before the motor was off: the motor is off now' in node.stderr.read()
    assert node.wait(LONGEST) == -end


def test_a_node_that_is_stopped_is_killed_when_its_launch_has_ended(device, launch, node):
    node.send_signal(signal.SIGSTOP)
    launch.kill()
    device.wait_for(b'OFF')
    os.write(device.master, b'OK')
    assert 'the motor is off now' in node.stderr.read()
    assert node.wait(LONGEST) == -signal.SIGKILL


def test_a_node_that_is_stopped_has_its_device_switched_off_each_time(device, node):
    for _ in range(2):
        order(node, 'guard.beat(); print(flush=True)')
        node.stdout.readline()
        node.send_signal(signal.SIGSTOP)
        device.received = b''
        device.wait_for(b'OFFOFF')
        os.write(device.master, b'OK')
        assert node.stderr.readline() == 'the node stands still: the motor is off now\n'
        node.send_signal(signal.SIGCONT)
    order(node, 'guard.dismiss(); sys.exit()')
    assert node.wait(LONGEST) == 0
    assert node.stderr.read() == ''


def test_a_node_that_ends_with_its_launch_is_not_killed(device, launch, node):
    launch.kill()
    order(node, 'guard.dismiss()')
    order(node, 'sys.exit(7)')
    assert node.wait(LONGEST) == 7
    assert node.stderr.read() == ''
    assert not select.select([device.master], [], [], 0)[0]


def test_what_kills_the_whole_process_group_spares_the_guard(device, node):
    os.kill(node.guard, signal.SIGINT)
    os.kill(node.guard, signal.SIGTERM)
    os.killpg(node.pid, signal.SIGKILL)
    device.wait_for(b'OFF')
    os.write(device.master, b'Ok')
    assert 'the motor is off now' in node.stderr.read()


def test_a_dismissed_guard_sends_nothing_and_is_gone(device, node):
    order(node, 'guard.dismiss()')
    order(node, 'print("dismissed", flush=True)')
    assert node.stdout.readline() == 'dismissed\n'
    with pytest.raises(ProcessLookupError):
        os.kill(node.guard, 0)
    node.kill()
    assert node.stderr.read() == ''
    assert not select.select([device.master], [], [], 0)[0]


def test_a_device_that_never_confirms_is_given_up_and_named(device, node):
    node.kill()
    assert 'did not confirm that it is off' in node.stderr.read()
    device.wait_for(b'OFF' * ATTEMPTS)
    most = LONGEST_ATTEMPT / ANSWER_TIMEOUT + ATTEMPTS
    assert ATTEMPTS < len(re.findall(b'OFF', device.received)) <= most


def test_a_port_that_hung_up_ends_the_guard(node, device):
    master, device.master = device.master, os.open(os.devnull, os.O_RDWR)
    os.close(master)
    node.kill()
    assert 'could not be reached' in node.stderr.read()


def test_a_full_port_is_tried_again():
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    while select.select([], [writer], [], 0)[1]:
        os.write(writer, bytes(4096))
    assert not switch_off(writer, b'OFF', b'OK')
    os.close(reader)
    os.close(writer)
