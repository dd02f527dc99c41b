"""Maps a recorded drive.

Reads scans, joint states and odometry from TF. Writes into a folder: the points of the map
(map.ply), its occupancy grid as map_server reads it (map.pgm, map.yaml), a picture (map.png), the
map to go on from (keyframes.npz), and the path of the robot as lines of time, position and
quaternion (trajectory.txt).
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import time
from typing import TypeVar

from nodlidar_assembler.bags.bag_options import add_topics, configuration, topics_of
from nodlidar_assembler.bags.read_bag import read_drive
from nodlidar_assembler.bags.sensor_log import clouds_in, SensorLog
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.plausibility.odometry_jitter import OdometryJitter
from nodlidar_common.arrays import Array
from nodlidar_common.command_line import LineParser
from nodlidar_common.parameter_file import file_values
from nodlidar_common.parameters import check
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.terminal import progress_bar, result_console, summary_table
from nodlidar_mapper.config import MapConfig
from nodlidar_mapper.mapper import Mapper, NO_MAP
from nodlidar_mapper.offline import estimates
from nodlidar_mapper.output.grid import GridConfig
from nodlidar_mapper.output.map_files import write_map
from nodlidar_mapper.output.map_folder import make_parent
from nodlidar_mapper.tracking.odometry_delay import is_worth_setting, KNOWN_ERROR, odometry_delay
import numpy as np

Config = TypeVar('Config', MapConfig, GridConfig)
# What a map needs, whatever a parameter file of the assembler says.
DESKEWED = {'profile': 'slam', 'ego_motion': 'deskew', 'cloud_mode': 'sweep'}


def main(argv: Sequence[str] | None) -> None:
    """Map the bag that a command line names, and print a summary.

    Raises
    ------
    ParameterError
        For a parameter that is not allowed.
    BagError, OSError
        If the bag cannot be read, or a file not be written.
    SystemExit
        After --help, or with status 2 and a line on stderr for an invalid option.
    """
    arguments = _parse(argv)
    begin = time.perf_counter()
    config = configuration(arguments.params, DESKEWED)
    mapper = Mapper(_given(arguments.params, MapConfig()))
    cells = _given(arguments.params, GridConfig())
    make_parent(arguments.output)
    log = read_drive(arguments.bag, config, topics_of(arguments))
    clouds, drops = clouds_in(log, config)
    with progress_bar() as bar:
        found = estimates(mapper, bar.track(clouds, description='mapping'), log, config)
    snapshot = mapper.snapshot(found)
    surface = write_map(arguments.output, snapshot, cells)
    seconds = time.perf_counter() - begin
    recorded = (log.scans[-1].stamp_ns - log.scans[0].stamp_ns) / NS_PER_S
    rows: list[tuple[str, object]] = [
        ('written', arguments.output),
        ('clouds', len(clouds)),
        *((f'dropped: {reason}', count) for reason, count in drops.items()),
        ('clouds that do not fit the map', sum(each.lost not in ('', NO_MAP) for each in found)),
        *_odometry_rows(clouds, log, config),
        ('path', f'{_length(snapshot.path):.1f} m'),
        ('keyframes', len(snapshot.keyframes)),
        ('loops closed', snapshot.loops),
        ('points', len(surface.points)),
        ('done in', f'{seconds:.1f} s'),
        ('times real time', f'{recorded / seconds:.0f}'),
        *(('note', damage) for damage in log.damage),
    ]
    result_console().print(summary_table(rows))


def _odometry_rows(
    clouds: Sequence[Points], log: SensorLog, config: AssemblerConfig
) -> list[tuple[str, object]]:
    """Return by how much odometry is late, and its stamps jitter."""
    assert log.odometry is not None
    delay = odometry_delay(clouds, log.odometry, config)
    jitter = OdometryJitter.worst(log.odometry)
    late = ('odometry is late by', _late(*delay, config.odometry_delay))
    return [late] if jitter is None else [late, ('its stamps jitter by', jitter)]


def _length(path: Array) -> float:
    """Return the length of a path of poses (n, 4, 4) [m]."""
    return float(np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1).sum())


def _late(delay: float, error: float, known: float) -> str:
    """Return in words by how much odometry is late, beside what is known already [s]."""
    if np.isinf(error):
        return 'unknown: too few clouds without a jump of odometry'
    if error > KNOWN_ERROR:
        return 'unknown: the robot turned too little or too steadily'
    text = f'{1e3 * delay:.0f} ms, +- {1e3 * error:.0f}'
    if not is_worth_setting(delay, error):
        return text
    return f'{text}: set odometry_delay to {known + delay:.3f} in assembler and mapper'


def _given(params: Path | None, default: Config) -> Config:
    """Return a configuration with the values of a parameter file."""
    if params is None:
        return default
    config = replace(default, **file_values([params], 'mapper', type(default)))
    check(config)
    return config


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('map_bag', __doc__)
    parser.add_argument('bag', type=Path, help='a rosbag2 folder, or an .mcap or .db3 file')
    parser.add_argument('output', type=Path, help='folder to write to')
    parser.add_argument(
        '--params', type=Path, metavar='YAML', help='parameter file of assembler and mapper'
    )
    add_topics(parser)
    return parser.parse_args(argv)
