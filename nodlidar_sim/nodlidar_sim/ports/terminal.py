"""One device on one pseudo-terminal."""

import os
from pathlib import Path
import re
import select
import termios
import tty

from nodlidar_common.errors import PortError
from nodlidar_sim.devices.device import ChecksBitRate, Device
from nodlidar_sim.ports.byte_buffer import BoundedBuffer

_CHUNK = 4096
# Edge-triggered, since a terminal that no host has open is always ready.
_READ = select.EPOLLIN | select.EPOLLET

_BIT_RATES = {
    getattr(termios, name): int(name[1:]) for name in dir(termios) if re.fullmatch(r'B\d+', name)
}


class Terminal:
    """A device on a pseudo-terminal; bytes that it sends while no host has it open are lost.

    Attributes
    ----------
    buffer
        Bytes for which the terminal has no room yet.
    """

    def __init__(self, device: Device, link: Path | None, epoll: select.epoll) -> None:
        self.device = device
        self.buffer = BoundedBuffer()
        self._link = link
        self._epoll = epoll
        self._master: int | None = None
        self._target = ''
        self._hangup = select.poll()
        self._full = False

    @property
    def path(self) -> str:
        """Path at which a driver opens the device."""
        return self._target if self._link is None else str(self._link)

    @property
    def in_use(self) -> bool:
        """Whether a host has the device open."""
        return self._master is not None and not self._hangup.poll(0)

    def open(self) -> None:
        """Create the terminal and its link; raises PortError if the link's path is taken."""
        self._master, host_side = os.openpty()
        self._target = os.ttyname(host_side)
        tty.setraw(host_side)
        os.close(host_side)
        os.set_blocking(self._master, False)
        self._epoll.register(self._master, _READ)
        self._hangup.register(self._master, 0)
        if self._link is not None:
            create_link(self._link, self._target)

    def close(self) -> None:
        """Hang up and remove the link, unless closed already."""
        if self._master is None:
            return
        if self._link is not None and _points_to(self._link, self._target):
            self._link.unlink()
        self._hangup.unregister(self._master)
        os.close(self._master)
        self._master, self._full = None, False
        self.buffer.clear()

    def pump(self, now_ns: int) -> int | None:
        """Transfer bytes in both directions; return the time of the device's next event [ns]."""
        received = self._read()
        if received:
            self._set_host_bit_rate()
            self.device.receive(received, now_ns)
        self.buffer.append(self.device.transmit(now_ns))
        if len(self.buffer):
            self._write()
        return self.device.next_event_ns()

    def _read(self) -> bytes:
        if self._master is None:
            return b''
        received = b''
        try:
            while data := os.read(self._master, _CHUNK):
                received += data
        except OSError:  # no more bytes, or no host has the terminal open
            pass
        return received

    def _set_host_bit_rate(self) -> None:
        if isinstance(self.device, ChecksBitRate) and self._master is not None:
            speed = termios.tcgetattr(self._master)[5]
            self.device.host_bit_rate = _BIT_RATES.get(speed)

    def _write(self) -> None:
        if self._master is None or not self.in_use:
            self.buffer.clear()
            return
        full = self._fill(self._master)
        if full != self._full:
            self._epoll.modify(self._master, _READ | select.EPOLLOUT if full else _READ)
        self._full = full

    def _fill(self, master: int) -> bool:
        """Write as many bytes as the terminal has room for; return whether it is full."""
        try:
            while len(self.buffer):
                self.buffer.discard(os.write(master, self.buffer.peek(_CHUNK)))
        except BlockingIOError:
            return True
        return False


def create_link(link: Path, target: str) -> None:
    """Create a symbolic link, or replace one atomically.

    Raises
    ------
    PortError
        If its path exists and is no link, or its folder is not writable.
    """
    if link.exists() and not link.is_symlink():
        raise PortError(f"'{link}' exists and is no symbolic link: it is not replaced")
    fresh = link.with_name(f'.{link.name}.{os.getpid()}')
    try:
        link.parent.mkdir(parents=True, exist_ok=True)
        fresh.symlink_to(target)
        fresh.replace(link)
    except OSError as error:
        raise PortError(f"cannot make the link '{link}': {error.strerror}") from error


def _points_to(link: Path, target: str) -> bool:
    return link.is_symlink() and os.readlink(link) == target
