"""Parts of a SCIP 2.0 answer: status, timer, confirmation of a stop."""

import re

from nodlidar_common import scip
from nodlidar_common.errors import DeviceError
from nodlidar_common.guard import StopRequest
from nodlidar_common.scip import ScipError
from nodlidar_driver.scip import scip_status as status_of
from nodlidar_driver.scip.scan_window import ScanWindow

# The first line feed ends the rest of a broken command. 0E is the answer in time mode, in which
# the laser is off.
STOP = StopRequest('lidar', b'\nQT\n', rb'(?<![^\n])QT\n(00P|0Ee)\n\n')
_QUIT_ANSWER = re.compile(rb'(?<![^\n])QT\n([^\n]+)$')


def status_in(line: bytes) -> str:
    """Return a status, in SCIP 1.1 one character without a sum; ScipError if the sum is wrong."""
    return (line if len(line) == 1 else scip.strip_sum(line)).decode('ascii', 'replace')


def quit_status(message: bytes) -> str:
    """Return the status of the answer to QT at the end of a message; empty without one."""
    answer = _QUIT_ANSWER.search(message)
    try:
        return status_in(answer[1]) if answer else ''
    except ScipError:
        return ''


def timer(line: bytes) -> int:
    """Return the timer in a line [ms, 24 bits]; ScipError if it is invalid."""
    values = scip.decode(scip.strip_sum(line), 4)
    if len(values) != 1:
        raise ScipError(f'{line!r} is not a time')
    return int(values[0])


def message_length(window: ScanWindow) -> int:
    """Return the length of a scan message [bytes]: echo, status, time, data, empty line."""
    data = 3 * window.count
    lines = -(-data // scip.BLOCK)
    return 16 + 4 + 6 + data + 2 * lines + 1


def refused(command: str, status: str) -> DeviceError:
    """Return the error for a command that was answered with a status."""
    meaning = status_of.meaning(command, status)
    return DeviceError(f"the lidar answered '{command}' with status {status}: {meaning}")
