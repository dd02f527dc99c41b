"""The map in save_folder: saved while the robot drives, and when it or the node ends."""

from collections import deque
from collections.abc import Callable, Sequence
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
from nodlidar_mapper.output.grid import EmptyMapError
from nodlidar_mapper.output.map_folder import make_parent, save, save_keyframes_of
from rclpy.impl.rcutils_logger import RcutilsLogger

PERIOD = 30.0  # s
MOST_WAITING = 2  # maps that ended; a bag in a loop may end them sooner than they can be saved

MapInFolder = tuple[Path, MapSnapshot]


class KeptMap:
    """Saves the keyframes every PERIOD, and all files at the end, each map in its own folder.

    A map ends with the node, or when another one begins. The keyframes take a moment, the other
    files up to minutes, and a node may be killed. So keyframes come first, in their own thread;
    where that fails, it is tried again.

    Parameters
    ----------
    config, log
        Nothing is saved without save_folder.

    Raises
    ------
    ParameterError
        Now, and not after a drive, if no map can be saved there.
    """

    def __init__(self, config: MapperConfig, log: RcutilsLogger) -> None:
        self._config, self._log = config, log
        self._why: dict[Path, str] = {}  # maps are not saved, or not wholly
        self._thread, self._finishing = Background(), Background()
        self._ended: deque[MapInFolder] = deque()  # whose keyframes are not saved yet
        self._again_ns = 0  # when those are tried again that could not be saved
        self._unfinished: deque[MapInFolder] = deque()  # whose other files are not saved yet
        self._folders: set[Path] = set()
        if config.save_folder:
            _check(config.save_folder)
        self.begin()

    def begin(self, ended: MapSnapshot | None = None) -> None:
        """Take another map, which begins; the one that ended is saved."""
        if ended is not None and self._config.save_folder:
            self._ended.append((self._own_folder(), ended))
            self._again_ns = 0
        self._folder: Path | None = None
        self._saved: Sequence[Keyframe] = []
        self._wait()

    @property
    def unsaved(self) -> str:
        """Why a map is not saved, or not wholly: the newest such map; empty if all are."""
        return next(reversed(self._why.values()), '')

    def step(self, snapshot: MapSnapshot | None) -> None:
        """Save maps that ended, or the keyframes if it is time and they have changed."""
        self._thread.deliver()
        self._finishing.deliver()
        if self._unfinished and not self._finishing.busy:
            self._start(self._finishing, self._finish, self._unfinished.popleft(), self._note)
        if self._thread.busy:
            return
        if self._ended and steady_ns() >= self._again_ns:
            ended = self._ended.popleft()
            self._start(self._thread, self._save_keyframes, ended, self._note_ended)
        elif snapshot is not None and self._is_due(snapshot):
            self._wait()
            self._saved = snapshot.keyframes
            own = self._own_folder(), snapshot
            self._start(self._thread, self._save_keyframes, own, self._note_saved)

    def end(self, snapshot: MapSnapshot | None) -> None:
        """Save the map, and those before it that were not saved yet, all keyframes first."""
        self._thread.finish()
        self._finishing.finish()
        if snapshot is not None and self._config.save_folder:
            self._ended.append((self._own_folder(), snapshot))
        for ended in self._ended:
            self._note(ended, self._save_keyframes(*ended))
        for unfinished in (*self._unfinished, *self._ended):
            self._note(unfinished, self._finish(*unfinished) or self._why.get(unfinished[0], ''))
        self._unfinished.clear()
        self._ended.clear()

    def _is_due(self, snapshot: MapSnapshot) -> bool:
        """Return whether the keyframes are to be saved now."""
        wanted = bool(self._config.save_folder) and steady_ns() >= self._after_ns
        return wanted and self._saved != snapshot.keyframes

    def _start(
        self,
        thread: Background,
        save_map: Callable[[Path, MapSnapshot], str],
        one: MapInFolder,
        note: Callable[[MapInFolder, str], None],
    ) -> None:
        thread.start(lambda: save_map(*one), lambda why: note(one, why))

    def _note(self, one: MapInFolder, why: str) -> None:
        """Note why a map was not saved; empty if it was."""
        self._why.pop(one[0], None)
        if why:
            self._why[one[0]] = why

    def _note_saved(self, own: MapInFolder, why: str) -> None:
        self._note(own, why)
        if why:
            self._saved = []  # they are tried again, although they have not changed

    def _note_ended(self, ended: MapInFolder, why: str) -> None:
        self._note(ended, why)
        if not why:
            self._add_limited(self._unfinished, ended, 'has only keyframes')
            return
        self._again_ns = steady_ns() + round(PERIOD * NS_PER_S)
        self._add_limited(self._ended, ended, 'is not saved')

    def _add_limited(self, waiting: deque[MapInFolder], one: MapInFolder, lacks: str) -> None:
        """Add a map to those that wait in memory; forget the oldest if there are too many."""
        waiting.append(one)
        if len(waiting) > MOST_WAITING:
            folder, _ = waiting.popleft()
            self._log.warning(
                f"maps end faster than they can be saved: '{folder.absolute()}' {lacks}"
            )

    def _save_keyframes(self, folder: Path, snapshot: MapSnapshot) -> str:
        return self._why_not(lambda: save_keyframes_of(folder, snapshot))

    def _finish(self, folder: Path, snapshot: MapSnapshot) -> str:
        self._log.info(f"saving the other files of the map in '{folder.absolute()}'")
        return self._why_not(
            lambda: self._log.info(save(folder, snapshot, self._config, with_keyframes=False))
        )

    def _why_not(self, save_map: Callable[[], object]) -> str:
        """Save a map; return why it could not be saved, and log it."""
        try:
            save_map()
        except (NodlidarError, OSError) as error:
            text = f'the map was not saved: {in_words(error)}'
            self._log.error(text)
            return '' if isinstance(error, EmptyMapError) else text
        return ''

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


def _check(save_folder: str) -> None:
    try:
        make_parent(Path(save_folder))
    except (NodlidarError, OSError) as error:
        limit = f'a folder for maps ({in_words(error)})'
        raise ParameterError('save_folder', limit, save_folder) from error
