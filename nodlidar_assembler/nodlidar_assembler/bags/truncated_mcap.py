"""Reads a truncated MCAP file: all records that were written completely."""

from collections.abc import Collection, Generator
import os
import struct
from typing import BinaryIO

from rosbags.interfaces import Connection
from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.storage_mcap import McapReader

MAGIC = b'\x89MCAP0\r\n'


class TruncatedMcapReader(McapReader):
    """An MCAP file without its index: records are read one by one, up to the last whole one.

    A file (https://mcap.dev/spec) begins with MAGIC; a record is an opcode, the length of its
    content as a little-endian uint64, and the content.
    """

    def open(self) -> None:
        """Open the file; raise ReaderError if it is not an MCAP file or has no whole record."""
        self.bio = self.path.open('rb')
        try:
            if self.bio.read(len(MAGIC)) != MAGIC:
                raise ReaderError(f"'{self.path}' is not an MCAP file")
            self.data_start = len(MAGIC)
            self.data_end = _end_of_whole_records(self.bio)
            self.meta_scan()
        except BaseException:
            self.close()
            raise

    @property
    def message_count(self) -> int:
        """Number of messages."""
        return self.statistics.message_count if self.statistics else 0

    @property
    def start_time(self) -> int:
        """Recording time of the first message [ns]."""
        return self.statistics.start_time if self.statistics else 0

    @property
    def end_time(self) -> int:
        """Recording time of the last message, plus 1 ns."""
        return self.statistics.end_time + 1 if self.statistics else 0

    def messages(
        self,
        connections: Collection[Connection],
        start: int | None = None,
        stop: int | None = None,
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Yield messages in the order of writing."""
        yield from self.messages_scan(connections, start, stop)


def _end_of_whole_records(file: BinaryIO) -> int:
    size = file.seek(0, os.SEEK_END)
    position = len(MAGIC)
    while position + 9 <= size:
        file.seek(position + 1)
        (length,) = struct.unpack('<Q', file.read(8))
        if position + 9 + length > size:
            break
        position += 9 + length
    return position
