"""Writes the clouds of a bag into a file: the same clouds as those of the node."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
import time
from typing import Protocol

from nodlidar_assembler.bags.bag_replay import BagReplay, PublishLevel
from nodlidar_assembler.bags.bag_source import BagSource
from nodlidar_assembler.bags.bag_tf import tf_in
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.cloud_bag import CloudBag
from nodlidar_assembler.bags.point_files import OutputError, pcd_header, ply_header, PointFile
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.message_assembler import MessageAssembler
from nodlidar_common.bag_messages import TF
from nodlidar_common.whole_file import whole_file

SUFFIXES = ('.ply', '.pcd', '.mcap')

# Called regularly with the time reached in the bag, its first and its last time [ns].
OnProgress = Callable[[int, int, int], None]
_MESSAGES_BETWEEN = 500


class Output(Protocol):
    """A file that clouds are written to."""

    def write(self, cloud: Points, frame_id: str, now_ns: int) -> None:
        """Add a cloud in a frame, published at a time [ns]."""

    def close(self) -> None:
        """Finish the file."""

    def abandon(self) -> None:
        """Close the unfinished file; remove temporary ones."""


@dataclass(frozen=True, slots=True)
class Summary:
    """Result of assembling a bag.

    Attributes
    ----------
    counts
        scans, clouds and points.
    assembler
        Its drops and remarks.
    first_ns, last_ns
        Recording time of the first message, and just after that of the last [ns].
    seconds
        Time that the work took [s].
    notes
        Damage of the bag, joint positions that scatter, and whether a file was replaced.
    """

    counts: Counter[str]
    assembler: MessageAssembler
    first_ns: int
    last_ns: int
    seconds: float
    notes: list[str]


def write_clouds(
    bag: Path,
    path: Path,
    config: AssemblerConfig,
    topics: Topics,
    on_progress: OnProgress = lambda now_ns, first_ns, last_ns: None,
) -> Summary:
    """Write the clouds of a bag into a file, which appears, or is replaced, when it is complete.

    Raises
    ------
    BagError
        If the bag cannot be read, lacks a topic, or yields no cloud.
    OutputError
        If the file is of no known kind, cannot hold such clouds, or is the bag.
    OSError
        If the file cannot be written.
    """
    _check_output(path, bag, config)
    begin = time.perf_counter()
    with BagSource(bag) as source, _with_damage(source):
        wanted, tf = source.inputs(topics), None
        if config.ego_motion != 'off':
            moving = source.topic(TF, topics.tf)
            wanted[moving], tf = TF, tf_in(source, moving, config)
        first_ns, last_ns = source.span_ns
        replaced = [f"'{path}' existed and was replaced"] if path.exists() else []
        with open_output(path, config) as file:
            replay = BagReplay(config, file.write, tf, _level_output(file, config))
            for k, recorded in enumerate(source.messages(wanted)):
                replay.add(recorded)
                if not k % _MESSAGES_BETWEEN:
                    on_progress(recorded.time_ns, first_ns, last_ns)
            replay.finish()
            _check_result(source, replay)
        doubts = filter(None, replay.assembler.doubts)
        notes = [*source.damage, *replaced, *_left_out(path, config), *doubts]
    seconds = time.perf_counter() - begin
    return Summary(replay.counts, replay.assembler, first_ns, last_ns, seconds, notes)


def _level_output(file: Output, config: AssemblerConfig) -> PublishLevel | None:
    if config.level_scan == 'off' or not isinstance(file, CloudBag):
        return None
    return file.write_level_scan


def _left_out(path: Path, config: AssemblerConfig) -> list[str]:
    if config.level_scan == 'off' or path.suffix == '.mcap':
        return []
    return ['level scans are left out, which only an .mcap file holds']


@contextmanager
def _with_damage(source: BagSource) -> Iterator[None]:
    """Add the bag's damage to a BagError."""
    try:
        yield
    except BagError as error:
        raise BagError('; '.join([str(error), *source.damage])) from error


def _check_result(source: BagSource, replay: BagReplay) -> None:
    scans = replay.counts['scans']
    if not scans:
        raise BagError(f"'{source.path}' has no scan")
    if not replay.counts['clouds']:
        assembler = replay.assembler
        reasons = ', '.join(f'{n} {reason}' for reason, n in assembler.drops.items())
        missing = f' ({assembler.missing_input})' if assembler.missing_input else ''
        why = f'{reasons}{missing}' if reasons else 'none has a measurement'
        raise BagError(f'no cloud from {scans} scans: {why}')


def _check_output(path: Path, bag: Path, config: AssemblerConfig) -> None:
    if path.suffix not in SUFFIXES:
        raise OutputError(f"'{path}' must end in one of {', '.join(SUFFIXES)}")
    within = path.suffix == '.mcap' and path.resolve().parent == bag.resolve()
    if within or path.resolve() == bag.resolve():
        raise OutputError(f"'{path}' is the input bag, or in it")
    if path.is_dir():
        raise OutputError(f"'{path}' is a folder")
    if config.ego_motion == 'deskew' and path.suffix != '.mcap':
        what = 'with ego_motion deskew, each cloud is where the robot was at its own instant'
        raise OutputError(f'{what}, which only an .mcap file holds')
    frames = config.ego_motion != 'off' and config.without_odometry != 'drop'
    if frames and path.suffix != '.mcap':
        what = "without_odometry = 'uncompensated' gives clouds in two frames"
        raise OutputError(f'{what}, which only an .mcap file holds')


@contextmanager
def open_output(path: Path, config: AssemblerConfig) -> Iterator[Output]:
    """Open a file for clouds, of the kind of its suffix; it appears when it is complete."""
    with whole_file(path) as part:
        file: Output
        if path.suffix == '.mcap':
            file = CloudBag(part, config)
        else:
            file = PointFile(part, ply_header if path.suffix == '.ply' else pcd_header)
        try:
            yield file
            file.close()
        except BaseException:
            with suppress(OSError):  # the error that led here says more
                file.abandon()
            raise
