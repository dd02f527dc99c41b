"""The program of a guard: see :mod:`nodlidar_common.guard`.

It runs by its path and imports little, so that it starts fast and stays small.
"""

from contextlib import suppress
import os
import re
import select
import signal
import sys
import time

READY = b'ready'
DISMISSED = b'dismissed'
ATTEMPTS = 10
# s; longer than a rotation of most lidars, which answer once in each; slower ones answer a later
# request
ANSWER_TIMEOUT = 0.15
LAUNCH = 'NODLIDAR_LAUNCH'
"""Environment variable with the number of the process that the node has to end with."""

LONGEST_ATTEMPT = 10.0  # s for which a guard tries to reach a device that does not answer
LONGEST_END = 3.0  # s that a node has to end after its launch has ended
_LONGEST_ANSWER = 4096


def switch_off(port: int, request: bytes, confirmation: bytes) -> bool:
    """Send a stop request until it is confirmed; return whether it was.

    Parameters
    ----------
    port
        File descriptor of the open port, blocking or not.
    request, confirmation
        As of :class:`nodlidar_common.guard.StopRequest`.

    Raises
    ------
    OSError
        If the port is gone.
    """
    for _ in range(ATTEMPTS):
        if select.select([], [port], [], ANSWER_TIMEOUT)[1]:
            os.write(port, request)
            if _is_confirmed(port, confirmation):
                return True
    return False


def _is_confirmed(port: int, confirmation: bytes) -> bool:
    received, deadline = b'', time.monotonic() + ANSWER_TIMEOUT
    while (remaining := deadline - time.monotonic()) > 0.0:
        if select.select([port], [], [], remaining)[0]:
            data = os.read(port, _LONGEST_ANSWER)
            if not data:
                raise OSError('the port hung up')
            received = (received + data)[-_LONGEST_ANSWER:]
            if re.search(confirmation, received):
                return True
    return False


def _kill_without_launch(node: int) -> None:
    """Return when the node has ended; kill it if it does not end although its launch has.

    The kernel sends it SIGTERM then. A node that is stopped, or hangs, does not react.
    """
    with suppress(OSError):  # on a kernel before 5.3
        launch = os.pidfd_open(int(os.environ[LAUNCH]))
        ended = select.select([sys.stdin, launch], [], [])[0]
        if sys.stdin not in ended and not select.select([sys.stdin], [], [], LONGEST_END)[0]:
            os.kill(node, signal.SIGKILL)


def main(port: str, device: str, request: str, confirmation: str) -> None:
    """Wait for the end of standard input, then switch the device off unless dismissed."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    node = os.getppid()
    sys.stdout.buffer.write(READY)
    sys.stdout.close()
    os.close(1)
    if LAUNCH in os.environ:
        _kill_without_launch(node)
    if sys.stdin.buffer.read() == DISMISSED:
        return
    try:
        end, is_off = time.monotonic() + LONGEST_ATTEMPT, False
        while not is_off and time.monotonic() < end:
            is_off = switch_off(int(port), bytes.fromhex(request), bytes.fromhex(confirmation))
        result = 'is off now' if is_off else 'did not confirm that it is off'
    except OSError as error:
        result = f'could not be reached: {error}'
    print(f'the node ended before the {device} was off: the {device} {result}', file=sys.stderr)


if __name__ == '__main__':
    main(*sys.argv[1:])
