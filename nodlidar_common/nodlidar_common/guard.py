"""Switches a device off when the node that drives it is killed.

A node that is killed or crashes cannot switch its motor or laser off. A small process waits for
the end of a pipe that only the node holds open. When the node has ended for any reason, the
process sends the stop request on the node's port until the device confirms it. So it does when a
node stands still, as after Ctrl-Z: the node writes to the pipe as long as it goes on. A node that
a launch has started and that does not end with it, because it is stopped or hangs, is killed.
"""

from contextlib import suppress
from dataclasses import dataclass
import os
from pathlib import Path
import subprocess
import sys
import time

from nodlidar_common import guard_process

_DISMISSAL_TIMEOUT = 1.0  # s; it takes some 10 ms
_BEAT_PERIOD = 0.5  # s, of which the guard tolerates several


@dataclass(frozen=True, slots=True)
class StopRequest:
    """The request that switches a device off.

    Attributes
    ----------
    device
        Name of the device in the guard's message.
    request
        The bytes to send.
    confirmation
        Regular expression of the bytes that confirm the request.
    """

    device: str
    request: bytes
    confirmation: bytes


class Guard:
    """A process that switches a device off as soon as this process has ended.

    Parameters
    ----------
    port
        File descriptor of the device's open port. The guard shares it, so that no other process
        can lock the port before the device is off.
    stop
        The stop request.

    Raises
    ------
    OSError
        If the process cannot be started.
    """

    def __init__(self, port: int, stop: StopRequest) -> None:
        self._process = subprocess.Popen(
            [
                sys.executable,
                '-IS',  # starts in some 10 ms: nothing but the standard library
                str(Path(guard_process.__file__)),
                str(port),
                stop.device,
                stop.request.hex(),
                stop.confirmation.hex(),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            pass_fds=[port],
            start_new_session=True,  # a signal to the process group must not reach the guard
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._pipe = self._process.stdin
        os.set_blocking(self._pipe.fileno(), False)  # a stopped guard stops no node
        self._last_beat = 0.0  # s
        with self._process.stdout as output:
            if output.read() != guard_process.READY:
                raise OSError('the guard of the port could not be started')

    @property
    def has_ended(self) -> bool:
        """Whether the guard was killed or crashed: nothing would switch the device off."""
        return self._process.poll() is not None

    def beat(self) -> None:
        """Show that this process goes on.

        Once it has, it must do so at least once a second, or the device is switched off.
        """
        now = time.monotonic()
        if now - self._last_beat > _BEAT_PERIOD:
            self._last_beat = now
            self._write(guard_process.BEAT)

    def trigger(self) -> None:
        """Switch the device off as if this process had ended."""
        self._pipe.close()

    def dismiss(self) -> None:
        """End the guard without a stop request: the device is off, or unplugged."""
        self._write(guard_process.DISMISSED)
        self.trigger()
        try:
            self._process.wait(_DISMISSAL_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _write(self, data: bytes) -> None:
        with suppress(BrokenPipeError):  # the guard was killed
            self._pipe.write(data)
