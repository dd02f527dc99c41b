"""Reads the truncated SQLite file of a bag.

Its rows are the leaves of a tree of pages; those that the remaining pages lead to are read.
"""

from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
import sqlite3
from typing import Any

from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
)
from rosbags.rosbag2 import ReaderError


class TruncatedSqliteReader:
    """A .db3 file without its last pages: the remaining rows are read one by one.

    Attributes
    ----------
    connections
        The topics.
    message_count, start_time, end_time
        Number of messages, recording time of the first, and just after that of the last [ns].
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.connections: list[Connection] = []
        self.message_count, self.start_time, self.end_time = 0, 0, 0

    def open(self) -> None:
        """Open the file; raise ReaderError if it is not that of a bag, or no message is left."""
        self._database = sqlite3.connect(f'{self.path.absolute().as_uri()}?immutable=1', uri=True)
        try:
            # With this, a database that is too short can be opened, too.
            self._database.execute('PRAGMA writable_schema = ON')
            topics = self._database.execute('SELECT id, name, type FROM topics').fetchall()
        except sqlite3.Error as error:
            self.close()
            raise ReaderError(f"'{self.path}': {error}") from error
        self.connections = [self._connection(*topic) for topic in topics]
        for (time_ns,) in self._rows('timestamp'):
            self.start_time = min(time_ns, self.start_time or time_ns)
            self.end_time = max(time_ns + 1, self.end_time)
            self.message_count += 1
        if not self.message_count:
            self.close()
            raise ReaderError(f"'{self.path}': the pages that lead to its messages are missing")

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def messages(
        self, connections: Collection[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield messages in the order of writing."""
        wanted = {each.id: each for each in connections}
        for topic, time_ns, data in self._rows('topic_id, timestamp, data'):
            if topic in wanted:
                yield wanted[topic], time_ns, data

    def _rows(self, columns: str) -> Iterator[tuple[Any, ...]]:
        """Yield columns of the messages, as far as they can be read."""
        with suppress(sqlite3.DatabaseError):
            for row in self._database.execute(f'SELECT {columns} FROM messages ORDER BY id'):
                if None not in row:  # missing pages read as None
                    yield row

    def _connection(self, number: int, topic: str, msgtype: str) -> Connection:
        unknown = MessageDefinition(MessageDefinitionFormat.NONE, '')
        ext = ConnectionExtRosbag2('cdr', [])
        return Connection(number, topic, msgtype, unknown, '', 0, ext, self)
