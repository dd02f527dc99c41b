"""The messages of a ROS 2 bag one by one, without ROS; also of a truncated bag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_topics import BagError, STATIC, Topics, USUAL
from nodlidar_assembler.bags.truncated_mcap import TruncatedMcapReader
from nodlidar_assembler.bags.truncated_sqlite import TruncatedSqliteReader
from nodlidar_common.bag_messages import JOINT_STATE, SCAN, STORE
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError

AnyReader = Reader | TruncatedMcapReader | TruncatedSqliteReader
_TRUNCATED: dict[str, type[TruncatedMcapReader | TruncatedSqliteReader]] = {
    '.mcap': TruncatedMcapReader,
    '.db3': TruncatedSqliteReader,
}
MOST_NS = 2**63  # ROS counts time in 63 bits
_COMPRESSED = '.zstd'
_ZSTD_FRAME = b'\x28\xb5\x2f\xfd'  # first bytes; a message begins with 0


@dataclass(frozen=True, slots=True)
class _Opened:
    """An open reader and its checked metadata."""

    reader: AnyReader
    connections: list[Connection]
    count: int
    first_ns: int
    end_ns: int

    @classmethod
    def of(cls, reader: AnyReader) -> _Opened:
        """Check a reader's metadata; raise ReaderError for impossible values."""
        connections = list(reader.connections)
        texts = [text for each in connections for text in (each.topic, each.msgtype)]
        count, first_ns, end_ns = reader.message_count, reader.start_time, reader.end_time
        numbers = [count, first_ns, end_ns, *(each.msgcount for each in connections)]
        if not all(isinstance(text, str) for text in texts):
            raise ReaderError('names of topics or types that are not text')
        if not all(type(number) is int and 0 <= number < MOST_NS for number in numbers):
            raise ReaderError('impossible counts or times')
        if count and end_ns < first_ns:
            raise ReaderError('an end before the beginning')
        return cls(reader, connections, count, first_ns, end_ns)


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message of a bag with its topic, type and time of recording [ns]."""

    topic: str
    msgtype: str
    time_ns: int
    message: Any


class BagSource:
    """An open bag: a context manager.

    Holds one chunk of a file at a time, for bags of any length.

    Parameters
    ----------
    path
        A folder with metadata.yaml, an .mcap or a .db3 file. Without metadata.yaml, which a
        killed recorder does not write, the files of the folder are read.

    Attributes
    ----------
    notes
        Damage of the bag, in words.
    unreadable
        Messages that could not be decoded, counted by topic.

    Raises
    ------
    BagError
        If there is no such bag, or none of it can be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []
        self.unreadable: Counter[str] = Counter()
        self._readers: list[_Opened] = []
        self._stack = ExitStack()

    def __enter__(self) -> BagSource:
        if not self.path.exists():
            raise BagError(f"there is no '{self.path}'")
        if self.path.suffix == '.bag':
            convert = f'rosbags-convert --src {self.path} --dst {self.path.with_suffix("")}'
            raise BagError(f"'{self.path}' is a bag of ROS 1: {convert} makes one of ROS 2")
        if not self.path.is_dir() or (self.path / 'metadata.yaml').exists():
            reader, why = self._opened(partial(Reader, self.path))
            if reader is not None:
                self._readers = [reader]
                return self
            self.notes.append(why)
        else:
            self.notes.append('there is no metadata.yaml: the recording was not finished')
        self._open_files()
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def _open_files(self) -> None:
        for file in _files(self.path):
            if file.suffix == _COMPRESSED:
                self.notes.append(f"'{file.name}' is compressed: unpack it with unzstd")
                continue
            reader, why = self._opened(partial(Reader, file))
            if reader is None and file.suffix in _TRUNCATED:
                reader, why = self._opened(partial(_TRUNCATED[file.suffix], file))
                if reader is not None:
                    why = f"'{file.name}' ends early: read up to there"
            if reader is not None:
                self._readers.append(reader)
            self.notes += [why] if why else []
        if not self._readers:
            raise BagError(f"nothing of '{self.path}' can be read: {'; '.join(self.notes)}")

    def _opened(self, make: Callable[[], AnyReader]) -> tuple[_Opened | None, str]:
        """Return an open reader, or None and why it cannot be."""
        with ExitStack() as closing:
            try:
                reader = make()
                reader.open()
                closing.callback(_close, reader)
                opened = _Opened.of(reader)
            except Exception as error:  # a file of another kind raises anything
                return None, _in_a_line(error)
            self._stack.push(closing.pop_all())
        return opened, ''

    @property
    def damage(self) -> list[str]:
        """What of the bag could not be read, in words."""
        unread = [f'{n} on {topic} could not be decoded' for topic, n in self.unreadable.items()]
        return [*self.notes, *unread]

    @property
    def types(self) -> dict[str, str]:
        """Return the type of each topic."""
        return {c.topic: c.msgtype for each in self._readers for c in each.connections}

    def topic(self, kind: str, chosen: str) -> str:
        """Return the chosen topic of a type; if empty, the usual one, or the only one.

        Raises
        ------
        BagError
            If the bag lacks it, or has several to choose from.
        """
        types = self.types
        usual, option = USUAL[kind]
        found = [name for name, of in types.items() if of == kind and not name.endswith(STATIC)]
        if not chosen and usual not in found and len(found) > 1:
            names = ', '.join(sorted(found))
            raise BagError(f"'{self.path}' has {kind} on {names}: choose one with {option}")
        topic = chosen or (usual if usual in found or not found else found[0])
        if topic not in types:
            present = ', '.join(f'{name} ({of})' for name, of in sorted(types.items()))
            raise BagError(f"'{self.path}' has no topic {topic}; it has {present or 'none'}")
        if types[topic] != kind:
            raise BagError(f'{topic} is of the type {types[topic]}, not {kind}')
        return topic

    def inputs(self, topics: Topics) -> dict[str, str]:
        """Return the topics of scans and joint states with their types; raises as `topic`."""
        scan, joint_states = topics.scan, topics.joint_states
        return {self.topic(SCAN, scan): SCAN, self.topic(JOINT_STATE, joint_states): JOINT_STATE}

    @property
    def span_ns(self) -> tuple[int, int]:
        """Return the recording time of the first message, and just after that of the last [ns]."""
        filled = [each for each in self._readers if each.count]
        if not filled:
            raise BagError(f"'{self.path}' is empty")
        return min(each.first_ns for each in filled), max(each.end_ns for each in filled)

    def messages(self, wanted: Mapping[str, str]) -> Iterator[Recorded]:
        """Yield the messages of topics, given with their types, in the order of recording.

        The rest of a file after damage is left out; `notes` names the damage.
        """
        for each in self._readers:
            connections = [c for c in each.connections if wanted.get(c.topic) == c.msgtype]
            if connections:
                yield from self._messages_of(each.reader, connections)

    def _messages_of(self, reader: AnyReader, connections: list[Connection]) -> Iterator[Recorded]:
        raw, missing = reader.messages(connections), sum(each.msgcount for each in connections)
        while True:
            try:
                connection, time_ns, data = next(raw)
            except StopIteration:
                if missing > 0:
                    self._note(f'the bag is damaged: {missing} messages are missing')
                return
            except Exception as error:  # of the decompressor or the database
                self._note(f'the bag is damaged, the rest is left out: {_in_a_line(error)}')
                return
            missing -= 1
            try:
                message = STORE.deserialize_cdr(data, connection.msgtype)
                if not 0 <= time_ns < MOST_NS:
                    raise ReaderError('an impossible time')
            except Exception:  # other bytes raise anything
                self.unreadable[connection.topic] += 1
                if data[: len(_ZSTD_FRAME)] == _ZSTD_FRAME:
                    self._note('each message is compressed: pass the folder with metadata.yaml')
            else:
                yield Recorded(connection.topic, connection.msgtype, time_ns, message)

    def _note(self, note: str) -> None:
        self.notes += [] if note in self.notes else [note]


def messages_of(path: Path, wanted: Callable[[str, str], bool]) -> Iterator[Recorded]:
    """Yield the messages of a bag whose topic and type are wanted.

    Raises
    ------
    BagError
        If any of the bag cannot be read.
    """
    with BagSource(path) as source:
        topics = {topic: kind for topic, kind in source.types.items() if wanted(topic, kind)}
        yield from source.messages(topics)
        damage = source.damage
    if damage:
        raise BagError(f"'{path}': {'; '.join(damage)}")


def _close(reader: AnyReader) -> None:
    with suppress(Exception):  # it was only read: nothing is lost
        reader.close()


def _in_a_line(error: Exception) -> str:
    """Return a library's error as one line; with its type unless it is a ReaderError."""
    text = ' '.join(str(error).split())
    return text if isinstance(error, ReaderError) else f'damaged ({type(error).__name__}: {text})'


def _files(path: Path) -> list[Path]:
    """Return the files of a bag; those of a split bag in the order of their numbers."""
    if not path.is_dir():
        return [path]
    files = list(path.iterdir())
    found = [file for file in files if file.suffix in _TRUNCATED]
    found += [f for f in files if f.suffix == _COMPRESSED and f.with_suffix('') not in found]
    return sorted(found, key=lambda file: (len(file.name), file.name))
