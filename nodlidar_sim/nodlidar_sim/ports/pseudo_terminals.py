"""Emulated devices on pseudo-terminals, which drivers open like serial ports."""

from collections.abc import Iterable, Mapping
import contextlib
import os
from pathlib import Path
import select
import threading
import time
from types import TracebackType

from nodlidar_sim.devices.device import Device
from nodlidar_sim.ports.terminal import Terminal

_STOPPING_PERIOD = 0.005  # at which a stopping thread checks whether hosts are gone [s]
_WAKING_PERIOD = 0.5  # of a waiting main thread [s]


class HostClock:
    """The wall clock [ns] at construction, advanced by the monotonic clock.

    So setting the wall clock does not affect the devices.
    """

    def __init__(self) -> None:
        self._offset_ns = time.time_ns() - time.monotonic_ns()

    def __call__(self) -> int:
        """Return the host time [ns]."""
        return time.monotonic_ns() + self._offset_ns


class PseudoTerminals:
    """Runs devices on pseudo-terminals, in one thread, within its context.

    Parameters
    ----------
    devices
        The devices by name.
    links
        Paths of symbolic links to the terminals, by device name. Existing links are replaced and
        missing folders created; on exit, links and created folders are removed.

    Raises
    ------
    PortError
        On entry, if a link's path exists and is no link.
    """

    def __init__(
        self, devices: Mapping[str, Device], links: Mapping[str, Path] | None = None
    ) -> None:
        links = links or {}
        self._new_folders = missing_folders(links.values())
        self.clock = HostClock()
        self._epoll = select.epoll()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK)
        self._epoll.register(self._wake, select.EPOLLIN | select.EPOLLET)
        self._terminals = {
            name: Terminal(device, links.get(name), self._epoll)
            for name, device in devices.items()
        }
        self._lock = threading.Lock()
        self._stop_by = float('inf')
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name='pseudo-terminals', daemon=True)

    def __enter__(self) -> 'PseudoTerminals':
        try:
            for terminal in self._terminals.values():
                terminal.open()
        except BaseException:
            self._close()
            raise
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()
        self._thread.join()
        self._close()
        if self._error is not None and error is None:
            raise self._error

    def __getitem__(self, name: str) -> str:
        """Return the path at which a driver opens a device: its link, or its terminal."""
        return self._terminals[name].path

    def dropped(self, name: str) -> int:
        """Return the number of bytes dropped because the host did not read them."""
        return self._terminals[name].buffer.dropped

    def in_use(self, name: str) -> bool:
        """Return whether a host has a device open."""
        return self._terminals[name].in_use

    def close_device(self, name: str) -> None:
        """Unplug a device: its terminal hangs up, its link is removed."""
        with self._lock:
            self._terminals[name].close()
        self._wake_up()

    def reopen(self, name: str, device: Device | None = None) -> None:
        """Plug in a device again, or another one in its place."""
        with self._lock:
            terminal = self._terminals[name]
            terminal.device = device or terminal.device
            terminal.open()
        self._wake_up()

    def stop(self, grace: float = 0.0) -> None:
        """Ask the thread to stop; may be called from a signal handler.

        It continues while a host has a device open, but no longer than a grace period [s], so that
        drivers that stop at the same time can make their devices safe.
        """
        self._stop_by = time.monotonic() + grace
        self._wake_up()

    def running(self) -> bool:
        """Return whether the thread is running."""
        return self._thread.is_alive()

    def wait(self) -> None:
        """Wait until the thread ends: after `stop`, or after an error, which the exit raises.

        The kernel may give a signal to the thread; the handler runs once the main thread wakes up.
        """
        while self.running():
            self._thread.join(_WAKING_PERIOD)

    def _wake_up(self) -> None:
        os.eventfd_write(self._wake, 1)

    def _close(self) -> None:
        for terminal in self._terminals.values():
            terminal.close()
        for folder in self._new_folders:
            with contextlib.suppress(OSError):  # not empty: others use it
                folder.rmdir()
        self._epoll.close()
        os.close(self._wake)

    def _run(self) -> None:
        try:
            while not self._stopped():
                self._wait_for_event(self._pump())
        except BaseException as error:
            self._error = error
            for terminal in self._terminals.values():
                terminal.close()

    def _stopped(self) -> bool:
        if self._stop_by == float('inf'):
            return False
        in_use = any(terminal.in_use for terminal in self._terminals.values())
        return not in_use or time.monotonic() >= self._stop_by

    def _pump(self) -> float | None:
        """Serve every device; return the time until one must be served again [s], or None."""
        with self._lock:
            events = [terminal.pump(self.clock()) for terminal in self._terminals.values()]
        due = min((event for event in events if event is not None), default=None)
        if self._stop_by < float('inf'):
            return _STOPPING_PERIOD
        return None if due is None else max(0.0, (due - self.clock()) / 1e9)

    def _wait_for_event(self, timeout: float | None) -> None:
        """Wait for a host or for the timeout, which select resolves to 1 us and epoll to 1 ms."""
        select.select([self._epoll], [], [], timeout)
        self._epoll.poll(0)


def missing_folders(links: Iterable[Path]) -> list[Path]:
    """Return the missing folders of links, innermost first."""
    folders = {folder for link in links for folder in link.parents if not os.path.exists(folder)}
    return sorted(folders, key=lambda folder: len(folder.parts), reverse=True)
