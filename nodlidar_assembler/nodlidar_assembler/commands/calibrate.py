"""Calibrates the sensor from a static scene, by what must be flat.

Finds delay and zero of the joint, and the lidar's place in the nodding frame.
"""

import argparse
from collections.abc import Sequence
import math
from pathlib import Path
import shlex
import sys

from nodlidar_assembler.bags.bag_options import add_topics, configuration, topics_of
from nodlidar_assembler.calibration.beam_model import MeasuredBeams
from nodlidar_assembler.calibration.calibration import calibrate, Calibration, NAMES, OPTIONAL
from nodlidar_assembler.calibration.recorded import (
    log_of_bag,
    parameters,
    require_standing,
    start_values,
)
from nodlidar_assembler.clouds.band import BandConfig
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_common.bag_messages import JOINT_STATE, SCAN
from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import ParameterError
from nodlidar_common.terminal import result_console
from nodlidar_common.whole_file import check_writable, whole_file
from rich.table import Table
import yaml

LIVE = 'live'
SECONDS, LONGEST = 60.0, 600.0  # s
# What each value is, its unit in the table, and how many of these it has.
ROWS = {
    'delay': ('joint delay', 'ms', 1e3),
    'zero': ('joint zero', 'deg', math.degrees(1.0)),
    'roll': ('roll of the lidar', 'deg', math.degrees(1.0)),
    'yaw': ('yaw of the lidar', 'deg', math.degrees(1.0)),
    'x': ('lidar ahead of the nod axis, x', 'mm', 1e3),
    'z': ('lidar above the nod axis, z', 'mm', 1e3),
    'elevation': ('elevation of the beams', 'deg', math.degrees(1.0)),
    'offset': ('added to each range', 'mm', 1e3),
}
NEVER = {
    'y': 'a shift of the whole cloud: no nod shows it',
    'pitch': 'the same as a joint zero with another x and z',
}
UNASKED = {
    'elevation': 'only with --elevation, for lidars whose beams rise out of their plane, '
    'as an LD19',
    'offset': 'only with --range-offset, for lidars that measure all ranges too long or short',
}


def main(argv: Sequence[str] | None) -> None:
    """Calibrate by a command line: print a table, and write the parameters.

    Raises
    ------
    ParameterError
        For a parameter that is not allowed.
    BagError, CalibrationError, OSError
        If there is nothing to calibrate from, or the file cannot be written.
    SystemExit
        After --help, or with status 2 and a line on stderr for an invalid option.
    """
    arguments = _parse(argv)
    if not 0.0 < arguments.seconds <= LONGEST:
        raise ParameterError('--seconds', f'above 0 and at most {LONGEST:g} s', arguments.seconds)
    config = configuration(arguments.params, {})
    check_writable(arguments.output)
    if arguments.source == LIVE:
        from nodlidar_assembler.ros.live_log import record  # only the running sensor needs ROS

        topics = arguments.scan or 'scan', arguments.joint_states or 'joint_states'
        log, config = record(config if arguments.params else None, *topics, arguments.seconds)
    else:
        log = log_of_bag(Path(arguments.source), config, topics_of(arguments))
    unused = [f'dropped: {count} {reason}' for reason, count in log.drops.items()]
    for line in (*log.damage, *unused):
        print(line, file=sys.stderr)
    require_standing(log)
    tilt = arguments.mount_rpy[:2] if arguments.mount_rpy else config.mount_tilt
    up = None if arguments.not_level else BandConfig(mount_tilt=tilt).levelled[2]
    beams = MeasuredBeams.of(log, config.max_range or math.inf, config.max_joint_gap)
    wanted = [name for name in OPTIONAL if getattr(arguments, name)]
    found = calibrate(beams, start_values(config), up, (*NAMES, *wanted))
    write(arguments.output, found, config)  # first: the reader of the table may go away
    result_console().print(result_table(found, arguments.output))


def result_table(found: Calibration, output: Path) -> Table:
    """Return a calibration as a table."""
    table = Table('value', 'before', 'after', 'standard error', 'unit')
    for column in table.columns[1:4]:
        column.justify = 'right'
    for name in (each for each in ROWS if _is_asked(found, each)):
        title, unit, scale = ROWS[name]
        before, after = (getattr(each, name) * scale for each in (found.start, found.values))
        if name in found.undetermined:
            table.add_row(title, f'{before:.3f}', 'not determined', '', unit)
        else:
            error = found.errors[name] * scale
            table.add_row(title, f'{before:.3f}', f'{after:.3f}', f'{error:.3f}', unit)
    thickness = (f'{each * 1e3:.1f}' for each in (found.before, found.after))
    table.add_row(f'RMS thickness of {found.planes} planes', *thickness, '', 'mm')
    lines = [f'{name} is not determined: {why}' for name, why in _left_open(found).items()]
    use = f'use it: robot.launch.py calibration:={shlex.quote(str(output))}'
    table.caption = '\n'.join([*lines, use])
    table.caption_justify = 'left'
    return table


def write(path: Path, found: Calibration, config: AssemblerConfig) -> None:
    """Write the parameters as a file of parameters; raises OSError."""
    values = parameters(found.values, config)
    errors = ', '.join(f'{name} {value:.2g}' for name, value in found.errors.items())
    left = ', '.join(_left_open(found))
    text = (
        '# Written by: ros2 run nodlidar_assembler calibrate\n'
        f'# Standard errors [s, rad, m]: {errors}.\n'
        f'# Not determined, and left as before: {left}.\n'
    )
    rounded = {
        key: [round(each, 6) for each in value] if isinstance(value, list) else round(value, 6)
        for key, value in values.items()
    }
    text += yaml.safe_dump({'/**': {'ros__parameters': rounded}}, default_flow_style=None)
    with whole_file(path) as part:
        part.write_text(text, encoding='utf-8')


def _left_open(found: Calibration) -> dict[str, str]:
    """Return why values are as before, by their names."""
    unasked = {name: why for name, why in UNASKED.items() if not _is_asked(found, name)}
    return found.undetermined | NEVER | unasked


def _is_asked(found: Calibration, name: str) -> bool:
    return name in found.errors or name in found.undetermined


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('calibrate', __doc__)
    parser.add_argument(
        'source', metavar='BAG|live', help='a rosbag2 folder or file, or the running sensor'
    )
    parser.add_argument(
        '--output',
        type=Path,
        metavar='YAML',
        default=Path('calibration.yaml'),
        help='file to write or replace',
    )
    parser.add_argument(
        '--params',
        type=Path,
        metavar='YAML',
        help='parameter file of the assembler node [default with live: what the node has]',
    )
    parser.add_argument(
        '--mount-rpy',
        type=float,
        nargs=3,
        metavar=('ROLL', 'PITCH', 'YAW'),
        help='orientation of the sensor in the level robot [rad], as mount_rpy of the launch file '
        '[default: mount_tilt of the parameters]',
    )
    parser.add_argument(
        '--not-level',
        action='store_true',
        help='floors and walls are not level and upright: the joint zero then stays open',
    )
    parser.add_argument(
        '--elevation',
        action='store_true',
        help='also find at which angle beams rise out of the plane in which the lidar turns, '
        'as those of an LD19 do',
    )
    parser.add_argument(
        '--range-offset',
        dest='offset',
        action='store_true',
        help='also find by how much the lidar measures all ranges too long or too short, as an '
        'LD19 may by 45 mm',
    )
    parser.add_argument(
        '--seconds', type=float, default=SECONDS, help='how long to record the running sensor [s]'
    )
    add_topics(parser, (SCAN, JOINT_STATE))
    arguments = parser.parse_args(argv)
    if not all(abs(angle) <= math.tau for angle in arguments.mount_rpy or ()):
        parser.error('argument --mount-rpy: angles are in radians, within a turn')
    return arguments
