"""The program of a guard: see :mod:`nodlidar_common.guard`.

It runs by its path and imports little, so that it starts fast and stays small.
"""

from collections.abc import Callable
from contextlib import suppress
import math
import os
import re
import select
import signal
import sys
import time

READY = b'ready'
DISMISSED = b'dismissed'
BEAT = b'.'
ATTEMPTS = 10
# s; longer than a rotation of most lidars, which answer once in each; slower ones answer a later
# request
ANSWER_TIMEOUT = 0.15
LAUNCH = 'NODLIDAR_LAUNCH'
"""Environment variable with the number of the process that the node has to end with."""

LONGEST_ATTEMPT = 10.0  # s for which a guard tries to reach a device that does not answer
LONGEST_END = 3.0  # s that a node has to end after its launch has ended
LONGEST_STANDSTILL = 3.0  # s for which a node may not show that it goes on
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


def _wait_for_end(node: int, off: Callable[[], bool]) -> bytes:
    """Return the last bytes of standard input, when the node has ended.

    A node that has shown that it goes on, and shows it no more, stands still: its device is
    switched off until it is confirmed. A node that does not end although its launch has is killed:
    the kernel sends it SIGTERM then, to which one that is stopped, or hangs, does not react.
    """
    last, is_off, launch, ends = b'', False, _launch(), math.inf
    while True:
        longest = math.inf if is_off or not last else LONGEST_STANDSTILL
        wait = min(longest, max(ends - time.monotonic(), 0.0))
        inputs = [0] if launch is None else [0, launch]
        ready = select.select(inputs, [], [], None if wait == math.inf else wait)[0]
        if 0 in ready:
            data = os.read(0, _LONGEST_ANSWER)
            if not data:
                return last
            last, is_off = (last + data)[-len(DISMISSED) :], False
        elif ready:
            launch, ends = None, time.monotonic() + LONGEST_END
        elif time.monotonic() >= ends:
            os.kill(node, signal.SIGKILL)
            ends = math.inf
        else:
            is_off = off()


def _launch() -> int | None:
    """Return a file descriptor of the launch; None without one, or on a kernel before 5.3."""
    with suppress(KeyError, OSError):
        return os.pidfd_open(int(os.environ[LAUNCH]))
    return None


def main(port: str, device: str, request: str, confirmation: str) -> None:
    """Wait for the end of standard input, then switch the device off unless dismissed."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)

    def off(why: str, duration: float) -> bool:
        end, is_off = time.monotonic() + duration, False
        try:
            while not is_off and time.monotonic() < end:
                is_off = switch_off(int(port), bytes.fromhex(request), bytes.fromhex(confirmation))
            result = 'is off now' if is_off else 'did not confirm that it is off'
        except OSError as error:
            result, is_off = f'could not be reached: {error}', True
        print(f'{why}: the {device} {result}', file=sys.stderr)
        return is_off

    node = os.getppid()
    sys.stdout.buffer.write(READY)
    sys.stdout.close()
    os.close(1)
    last = _wait_for_end(node, lambda: off('the node stands still', LONGEST_STANDSTILL))
    if last != DISMISSED:
        off(f'the node ended before the {device} was off', LONGEST_ATTEMPT)


if __name__ == '__main__':
    main(*sys.argv[1:])
