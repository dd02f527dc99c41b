"""Assembles the clouds of a recorded bag.

The clouds are those that the assembler node publishes for the same messages and parameters.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nodlidar_assembler.bags.bag_options import add_topics, configuration, topics_of
from nodlidar_assembler.bags.bag_topics import Topics
from nodlidar_assembler.bags.write_clouds import SUFFIXES, Summary, write_clouds
from nodlidar_assembler.clouds.level_ranges import LEVEL_SCANS
from nodlidar_assembler.clouds.pipeline import CLOUD_MODES, EGO_MOTION_MODES
from nodlidar_assembler.clouds.pitch_estimator import ESTIMATORS
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.profiles import PROFILES
from nodlidar_common.command_line import LineParser
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.terminal import progress_bar, result_console, summary_table


def main(argv: Sequence[str] | None) -> None:
    """Assemble the bag that a command line names, and print a summary.

    Raises
    ------
    ParameterError
        For a parameter that is not allowed.
    BagError, OutputError, OSError
        See `write_clouds`.
    SystemExit
        After --help, or with status 2 and a line on stderr for an invalid option.
    """
    arguments = _parse(argv)
    config = configuration(arguments.params, _chosen(arguments))
    summary = _with_bar(arguments.bag, arguments.output, config, topics_of(arguments))
    result_console().print(summary_table(_rows(summary, arguments.output)))


def _rows(summary: Summary, output: Path) -> list[tuple[str, object]]:
    drops, remarks = summary.assembler.drops, summary.assembler.remarks
    begin, end = summary.first_ns / NS_PER_S, summary.last_ns / NS_PER_S
    return [
        ('written', output),
        *(summary.counts | remarks).items(),
        *((f'dropped: {reason}', count) for reason, count in drops.items()),
        *([] if drops else [('dropped', 0)]),
        ('recorded', f'{begin:.3f} .. {end:.3f} s'),
        ('', f'{end - begin:.3f} s'),
        ('done in', f'{summary.seconds:.3f} s'),
        ('times real time', f'{(end - begin) / summary.seconds:.0f}'),
        *(('note', note) for note in summary.notes),
    ]


def _with_bar(bag: Path, output: Path, config: AssemblerConfig, topics: Topics) -> Summary:
    with progress_bar() as progress:
        task = progress.add_task(f'assembling {bag}', total=1.0)

        def show(now_ns: int, first_ns: int, last_ns: int) -> None:
            progress.update(task, completed=(now_ns - first_ns) / max(last_ns - first_ns, 1))

        return write_clouds(bag, output, config, topics, show)


def _chosen(arguments: argparse.Namespace) -> dict[str, Any]:
    options = ('profile', 'estimator', 'cloud_mode', 'ego_motion', 'level_scan')
    return {key: getattr(arguments, key) for key in options if getattr(arguments, key)}


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('assemble_bag', __doc__)
    parser.add_argument('bag', type=Path, help='a rosbag2 folder, or an .mcap or .db3 file')
    kinds = ', '.join(SUFFIXES)
    parser.add_argument('output', type=Path, help=f'file to write or replace: {kinds}')
    parser.add_argument(
        '--params', type=Path, metavar='YAML', help='parameter file of the assembler node'
    )
    parser.add_argument(
        '--profile', choices=tuple(PROFILES), help='defaults of the other parameters'
    )
    for option, choices in (
        ('--estimator', ESTIMATORS),
        ('--cloud-mode', CLOUD_MODES),
        ('--ego-motion', EGO_MOTION_MODES),
        ('--level-scan', LEVEL_SCANS),
    ):
        parser.add_argument(option, choices=choices, help='parameter; overrides the file')
    add_topics(parser)
    return parser.parse_args(argv)
