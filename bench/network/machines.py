"""Two machines on one host: network namespaces, joined by a line that delays and loses packets.

The kernel's own emulation (`tc netem`) is a module that many kernels lack. So each machine has a
TAP device as its network card, and a thread carries the Ethernet frames between them. All
protocols go the same way: multicast, IP fragments, ARP. Only this needs rights: a namespace and
a TAP device. Nothing is left behind: both end with their last process.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
import ctypes
from dataclasses import dataclass
import fcntl
import heapq
import os
import select
import struct
import subprocess
import threading
import time
from typing import TypeVar

from nodlidar_common.errors import NodlidarError
import numpy as np

MTU = 1500  # bytes
CARD = 'line0'
_CLONE_NEWNET = 0x40000000
_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454CA, 0x0002, 0x1000  # linux/if_tun.h
_HEADER = 14  # bytes of Ethernet
_LONGEST_QUEUE = 1000  # frames, as the kernel's netem

Result = TypeVar('Result')


class NoRightsError(NodlidarError):
    """Network namespaces or TAP devices cannot be made here."""


@dataclass(frozen=True, slots=True)
class Line:
    """The behaviour of a line, the same in both directions.

    Frames keep their order: jitter is that of a queue.

    Attributes
    ----------
    loss
        Share of the frames that are lost, each independently of the others.
    delay, jitter
        Smallest time on the way, and the width of the uniform distribution of what is added [s].
    """

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0


class Machine:
    """A network namespace with a card, and a thread that lives in it.

    Parameters
    ----------
    address
        IPv4 address with the length of its prefix.

    Raises
    ------
    NoRightsError
        If namespaces or TAP devices cannot be made.
    """

    def __init__(self, address: str) -> None:
        self._thread = ThreadPoolExecutor(1)
        try:
            self.card = self.run(lambda: _enter(address))
        except BaseException:
            self.close()
            raise

    def run(self, function: Callable[[], Result]) -> Result:
        """Call a function in the namespace; the processes that it starts stay there."""
        return self._thread.submit(function).result()

    def close(self) -> None:
        """End the thread and remove the card."""
        self._thread.shutdown()
        if hasattr(self, 'card'):
            os.close(self.card)


def _enter(address: str) -> int:
    """Move this thread into a new network namespace; return its card as a file."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(_CLONE_NEWNET):
        raise NoRightsError(f'no network namespace: {os.strerror(ctypes.get_errno())}')
    try:
        card = os.open('/dev/net/tun', os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        flags = struct.pack('16sH', CARD.encode(), _IFF_TAP | _IFF_NO_PI)
        fcntl.ioctl(card, _TUNSETIFF, flags)
        for command in (
            f'address add {address} dev {CARD}',
            f'link set {CARD} mtu {MTU} up',
            'link set lo up',
            f'route add 224.0.0.0/4 dev {CARD}',
        ):
            subprocess.run(['ip', *command.split()], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise NoRightsError(f'no TAP device: {error}') from error
    return card


class Machines:
    """Two machines and the line between them: a context manager.

    Parameters
    ----------
    line
        Behaviour of the line; may be set at any time.

    Attributes
    ----------
    robot, far
        The machines.
    sent, lost
        Bytes that came to the line, and frames that it lost, in each direction: from the robot,
        and to it.
    """

    def __init__(self, line: Line) -> None:
        self.line = line
        self.robot = Machine('10.77.0.1/24')
        try:
            self.far = Machine('10.77.0.2/24')
        except BaseException:
            self.robot.close()
            raise
        self.sent, self.lost = [0, 0], [0, 0]
        self._rng = np.random.default_rng(1)  # of losses and jitter
        self._cards = (self.robot.card, self.far.card)
        self._queue: list[tuple[float, int, int, bytes]] = []
        self._number = 0
        self._last_due = [0.0, 0.0]
        self._ends = threading.Event()
        self._carrier = threading.Thread(target=self._carry, name='line', daemon=True)

    def __enter__(self) -> Machines:
        self._carrier.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._ends.set()
        self._carrier.join()
        for machine in (self.robot, self.far):
            machine.close()

    def _carry(self) -> None:
        """Carry frames until the end."""
        while not self._ends.is_set():
            wait = 0.05
            if self._queue:
                wait = min(max(self._queue[0][0] - time.monotonic(), 0.0), wait)
            ready, _, _ = select.select(self._cards, [], [], wait)
            for card in ready:
                self._take(self._cards.index(card))
            self._deliver()

    def _take(self, end: int) -> None:
        """Take the frames that wait at an end of the line."""
        with suppress(BlockingIOError):
            while frame := os.read(self._cards[end], MTU + _HEADER + 4):
                self._accept(end, frame)

    def _accept(self, end: int, frame: bytes) -> None:
        self.sent[end] += len(frame)
        if self._rng.random() < self.line.loss or len(self._queue) >= _LONGEST_QUEUE:
            self.lost[end] += 1
            return
        due = time.monotonic() + self.line.delay + self.line.jitter * self._rng.random()
        due = self._last_due[end] = max(due, self._last_due[end])
        self._number += 1
        heapq.heappush(self._queue, (due, self._number, 1 - end, frame))

    def _deliver(self) -> None:
        while self._queue and self._queue[0][0] <= time.monotonic():
            _, _, end, frame = heapq.heappop(self._queue)
            try:
                os.write(self._cards[end], frame)
            except OSError:  # the card's queue is full, as on a real one
                self.lost[1 - end] += 1
