"""The thread and its guard on a pseudo-terminal, without ROS."""

import os
import pty
import queue
import select
from types import SimpleNamespace

from nodlidar_common.device_thread import DeviceThread
from nodlidar_common.guard import StopRequest
import pytest

LONGEST = 30.0  # s; only a failing test waits so long
STOP = StopRequest('motor', b'OFF', b'OK')


@pytest.fixture
def terminal():
    ours, theirs = pty.openpty()
    yield ours, os.ttyname(theirs)
    os.close(theirs)
    os.close(ours)


class FaultyDevice:
    """A device whose first switching off is a fault of the program."""

    def __init__(self, port):
        self.config = SimpleNamespace(port=port, baud_rate=115200, reconnect_delay=0.01)
        self.steps, self.connected = queue.Queue(), 0
        self.thread = DeviceThread(self, lambda text: None, lambda text: None)

    def connect(self):
        self.thread.open_port(0.1, STOP)
        self.connected += 1
        self.steps.put(self.connected)

    def cycle(self):
        if self.connected == 1:
            raise OSError('unplugged')
        self.thread._stop.wait(0.01)

    def disconnect(self):
        if self.connected == 1:
            self.connected = 2
            raise ZeroDivisionError('a fault of the program')


def test_the_guard_switches_off_what_an_error_of_the_program_left_on(
    terminal,
):
    ours, path = terminal
    device = FaultyDevice(path)
    device.thread.start()
    try:
        assert device.steps.get(timeout=LONGEST) == 1
        assert select.select([ours], [], [], LONGEST)[0]
        assert os.read(ours, 3) == b'OFF'
        os.write(ours, b'OK')
        assert device.steps.get(timeout=LONGEST) == 3
    finally:
        device.thread.stop()
