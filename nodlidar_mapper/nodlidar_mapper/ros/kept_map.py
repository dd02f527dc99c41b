"""The map in save_folder: saved while the robot drives, and when the node ends."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from nodlidar_common.command_line import in_words
from nodlidar_common.errors import NodlidarError, ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.steady import steady_ns
from nodlidar_mapper.background import Background
from nodlidar_mapper.config import MapperConfig
from nodlidar_mapper.graph.keyframe import Keyframe
from nodlidar_mapper.live import folder_by_time, make_parent, Progress, save, save_keyframes_of
from rclpy.impl.rcutils_logger import RcutilsLogger

PERIOD = 30.0  # s


class KeptMap:
    """Saves the keyframes every PERIOD, and all files at the end, each map in its own folder.

    The keyframes take a moment, the other files up to minutes, and a node may be killed.

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
        self._thread = Background()
        if config.save_folder:
            _check(config.save_folder)
        self.begin()

    def begin(self) -> None:
        """Take another map, which begins."""
        self._folder: Path | None = None
        self._saved: Sequence[Keyframe] = []
        self._wait()

    def step(self, progress: Progress | None) -> None:
        """Save the keyframes if it is time and they have changed."""
        self._thread.deliver()
        if progress is None or not self._config.save_folder or steady_ns() < self._after_ns:
            return
        if self._thread.busy or self._saved == progress.keyframes:
            return
        self._wait()
        self._saved, folder = progress.keyframes, self._own_folder()

        def job() -> None:
            with self._telling():
                save_keyframes_of(folder, progress)

        self._thread.start(job, lambda _: None)

    def end(self, progress: Progress | None) -> None:
        """Save the map."""
        self._thread.end()
        if progress is None or not self._config.save_folder:
            return
        folder = self._own_folder()
        with self._telling():
            save_keyframes_of(folder, progress)
            self._log.info(f"keyframes saved in '{folder.absolute()}', the other files follow")
            self._log.info(save(folder, progress, self._config, with_keyframes=False))

    def _wait(self) -> None:
        self._after_ns = steady_ns() + round(PERIOD * NS_PER_S)

    def _own_folder(self) -> Path:
        if self._folder is None:
            self._folder = folder_by_time(Path(self._config.save_folder))
        return self._folder

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Log why a map was not saved."""
        try:
            yield
        except (NodlidarError, OSError) as error:
            self._log.error(f'the map was not saved: {in_words(error)}')


def _check(save_folder: str) -> None:
    try:
        make_parent(Path(save_folder))
    except (NodlidarError, OSError) as error:
        limit = f'a folder for maps ({in_words(error)})'
        raise ParameterError('save_folder', limit, save_folder) from error
