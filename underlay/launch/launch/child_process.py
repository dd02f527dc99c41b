"""Child processes whose output is read line by line, through pipes or pseudo-terminals."""

from __future__ import annotations

import asyncio
import codecs
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
import pty
import signal

# A pipe holds at most 1 MiB, so this is enough to take out what a process left behind.
_CHUNK_BYTES = 1 << 16
_CHUNKS_LEFT_BEHIND = 16


class LineReader:
    """Hands the lines that arrive at a file descriptor to a function."""

    def __init__(self, fd: int, on_line: Callable[[str], None]) -> None:
        self._fd = fd
        self._on_line = on_line
        self._decoder = codecs.getincrementaldecoder('utf-8')('replace')
        self._partial = ''
        os.set_blocking(fd, False)
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(fd, self._read)

    def _read(self) -> bool:
        """Take in a chunk, and tell if there was one."""
        try:
            data = os.read(self._fd, _CHUNK_BYTES)
        except BlockingIOError:
            return False
        except OSError:  # how a pseudo-terminal says that its last user is gone
            data = b''
        if not data:
            self._loop.remove_reader(self._fd)
            return False
        *lines, self._partial = (self._partial + self._decoder.decode(data)).split('\n')
        for line in lines:
            self._on_line(line.rstrip('\r'))
        return True

    def close(self) -> None:
        """Take in what is left, the last line even if nothing ends it."""
        for _ in range(_CHUNKS_LEFT_BEHIND):
            if not self._read():
                break
        if self._partial:
            self._on_line(self._partial.rstrip('\r'))
        self._loop.remove_reader(self._fd)
        os.close(self._fd)


@contextmanager
def _closed_on_exit(fds: list[int]) -> Iterator[None]:
    try:
        yield
    finally:
        for fd in fds:
            os.close(fd)


class ChildProcess:
    """A running child process; made by :meth:`start`."""

    def __init__(
        self, process: asyncio.subprocess.Process, stdin: int, readers: list[LineReader]
    ) -> None:
        self._process = process
        self._stdin = stdin
        self._readers = readers

    @classmethod
    async def start(
        cls,
        cmd: list[str],
        on_stdout: Callable[[str], None],
        on_stderr: Callable[[str], None],
        *,
        cwd: str | None,
        env: dict[str, str],
        shell: bool,
        emulate_tty: bool,
    ) -> ChildProcess:
        """Start a process; its standard input stays open and empty.

        Raises
        ------
        OSError
            When it can't be started.

        """
        open_channel = pty.openpty if emulate_tty else os.pipe
        (out, out_child), (err, err_child) = open_channel(), open_channel()
        stdin_child, stdin = os.pipe()
        options = {'stdin': stdin_child, 'stdout': out_child, 'stderr': err_child}
        with _closed_on_exit(list(options.values())):
            try:
                process = await _spawn(cmd, shell, cwd=cwd, env=env, **options)
            except BaseException:
                with _closed_on_exit([out, err, stdin]):
                    raise
        return cls(process, stdin, [LineReader(out, on_stdout), LineReader(err, on_stderr)])

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    def send_signal(self, signal_number: signal.Signals) -> None:
        """Send a signal, unless the process ended."""
        if self._process.returncode is None:
            self._process.send_signal(signal_number)

    async def wait(self) -> int:
        """Wait for the end, all of the output read, and return the exit code."""
        returncode = await self._process.wait()
        for reader in self._readers:
            reader.close()
        os.close(self._stdin)
        return returncode


async def _spawn(cmd: list[str], shell: bool, **options) -> asyncio.subprocess.Process:
    if shell:
        return await asyncio.create_subprocess_shell(' '.join(cmd), **options)
    return await asyncio.create_subprocess_exec(*cmd, **options)
