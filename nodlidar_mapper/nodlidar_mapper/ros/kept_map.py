"""The map in save_folder: saved while the robot drives, and when it or the node ends."""

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
import time

from nodlidar_common.command_line import in_words
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S
from nodlidar_mapper.background import Background
from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.graph.map_snapshot import MapSnapshot
from nodlidar_mapper.live import make_parent, save, save_keyframes_of
from nodlidar_mapper.output.grid import EmptyMapError
from rclpy.impl.rcutils_logger import RcutilsLogger

PERIOD = 30.0  # s
MOST_WAITING = 2  # maps that ended; a bag in a loop may end them sooner than they can be saved


class KeptMap:
    """Saves the keyframes every PERIOD, and all files at the end, each map in its own folder.

    A map ends with the node, or when another one begins. The keyframes take a moment, the other
    files up to minutes, and a node may be killed. So keyframes come first, in their own thread.

    Parameters
    ----------
    config, log
        Nothing is saved without save_folder.

    Attributes
    ----------
    unsaved
        Why the newest map could not be saved; empty if it could.

    Raises
    ------
    ParameterError
        Now, and not after a drive, if no map can be saved there.
    """

    def __init__(self, config: MapperConfig, log: RcutilsLogger) -> None:
        self._config, self._log = config, log
        self.unsaved = ''
        self._thread, self._finishing = Background(), Background()
        self._ended: deque[tuple[Path, MapSnapshot]] = deque()  # whose keyframes are not saved yet
        self._unfinished: deque[tuple[Path, MapSnapshot]] = deque()  # whose other files are not
        self._folders: set[Path] = set()
        if config.save_folder:
            _check(config.save_folder)
        self.begin()

    def begin(self, ended: MapSnapshot | None = None) -> None:
        """Take another map, which begins; the one that ended is saved."""
        if ended is not None and self._config.save_folder:
            self._ended.append((self._own_folder(), ended))
        self._folder: Path | None = None
        self._saved: Sequence[Keyframe] = []
        self._wait()

    def step(self, snapshot: MapSnapshot | None) -> None:
        """Save maps that ended, or the keyframes if it is time and they have changed."""
        self._thread.deliver()
        self._finishing.deliver()
        if self._unfinished and not self._finishing.busy:
            self._finish_in_background(self._unfinished.popleft())
        if self._thread.busy:
            return
        if self._ended:
            ended = self._ended.popleft()
            self._add_unfinished(ended)
            self._save_in_background(ended)
        elif snapshot is not None and self._is_due(snapshot):
            self._wait()
            self._saved = snapshot.keyframes
            self._save_in_background((self._own_folder(), snapshot))

    def end(self, snapshot: MapSnapshot | None) -> None:
        """Save the map, and those before it that were not saved yet, all keyframes first."""
        self._thread.end()
        self._finishing.end()
        if snapshot is not None and self._config.save_folder:
            self._ended.append((self._own_folder(), snapshot))
        for map_in_folder in self._ended:
            self._save_keyframes(*map_in_folder)
        for map_in_folder in (*self._unfinished, *self._ended):
            self._finish(*map_in_folder)
        self._unfinished.clear()
        self._ended.clear()

    def _is_due(self, snapshot: MapSnapshot) -> bool:
        """Return whether the keyframes are to be saved now."""
        wanted = bool(self._config.save_folder) and steady_ns() >= self._after_ns
        return wanted and self._saved != snapshot.keyframes

    def _save_in_background(self, map_in_folder: tuple[Path, MapSnapshot]) -> None:
        self._thread.start(lambda: self._save_keyframes(*map_in_folder), self._note_saved)

    def _note_saved(self, _: None) -> None:
        if self.unsaved:
            self._saved = []  # they are tried again, although they have not changed

    def _finish_in_background(self, map_in_folder: tuple[Path, MapSnapshot]) -> None:
        self._finishing.start(lambda: self._finish(*map_in_folder), lambda _: None)

    def _add_unfinished(self, map_in_folder: tuple[Path, MapSnapshot]) -> None:
        """Add a map to those whose other files are to be saved, which wait in memory."""
        self._unfinished.append(map_in_folder)
        if len(self._unfinished) > MOST_WAITING:
            folder, _ = self._unfinished.popleft()
            self._log.warning(
                f"maps end faster than they can be saved: '{folder.absolute()}' has only keyframes"
            )

    def _save_keyframes(self, folder: Path, snapshot: MapSnapshot) -> None:
        with self._telling():
            save_keyframes_of(folder, snapshot)
            self.unsaved = ''

    def _finish(self, folder: Path, snapshot: MapSnapshot) -> None:
        with self._telling():
            self._log.info(f"saving the other files of the map in '{folder.absolute()}'")
            self._log.info(save(folder, snapshot, self._config, with_keyframes=False))

    def _wait(self) -> None:
        self._after_ns = steady_ns() + round(PERIOD * NS_PER_S)

    def _own_folder(self) -> Path:
        if self._folder is None:
            self._folder = self._new_folder()
        return self._folder

    def _new_folder(self) -> Path:
        """Return a folder that is named by the time, and no map's yet."""
        parent, name = Path(self._config.save_folder), time.strftime('%Y-%m-%d_%H-%M-%S')
        names = (name if number == 1 else f'{name}_{number}' for number in count(1))
        free = (
            parent / each
            for each in names
            if parent / each not in self._folders and not (parent / each).expanduser().exists()
        )
        self._folders.add(folder := next(free))
        return folder

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Log and note why a map was not saved."""
        try:
            yield
        except (NodlidarError, OSError) as error:
            text = f'the map was not saved: {in_words(error)}'
            self._log.error(text)
            if not isinstance(error, EmptyMapError):
                self.unsaved = text


def _check(save_folder: str) -> None:
    try:
        make_parent(Path(save_folder))
    except (NodlidarError, OSError) as error:
        limit = f'a folder for maps ({in_words(error)})'
        raise ParameterError('save_folder', limit, save_folder) from error
