"""Pipes whose lines are passed to a function."""

import asyncio
import codecs
from collections.abc import Callable
from contextlib import suppress
import os

# More than a pipe holds by default: one read empties it.
_CHUNK_BYTES = 1 << 20


class LinePipe:
    """A pipe for the output of a process, read in the running event loop.

    Its context ends with the process. The rest of the pipe is read then, and nothing that the
    process's own children may write later. The file descriptor to write to is `end`.
    """

    def __init__(self, on_line: Callable[[str], None]) -> None:
        self._fd, self.end = os.pipe()
        os.set_blocking(self._fd, False)
        self._on_line = on_line
        self._decode = codecs.getincrementaldecoder('utf-8')('replace').decode
        self._partial = ''

    def __enter__(self) -> 'LinePipe':
        asyncio.get_running_loop().add_reader(self._fd, self._read)
        return self

    def __exit__(self, *error: object) -> None:
        self._read()
        if self._partial:
            self._on_line(self._partial)
        asyncio.get_running_loop().remove_reader(self._fd)
        os.close(self._fd)
        os.close(self.end)

    def _read(self) -> None:
        with suppress(BlockingIOError):
            text = self._partial + self._decode(os.read(self._fd, _CHUNK_BYTES))
            *lines, self._partial = text.split('\n')
            for line in lines:
                self._on_line(line)
