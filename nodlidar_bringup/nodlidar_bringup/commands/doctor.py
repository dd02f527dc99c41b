"""Says what is wrong with devices, computer and running system."""

import argparse
from collections.abc import Sequence
import os

from nodlidar_bringup.checks.network import check_network
from nodlidar_bringup.checks.network_facts import network_facts
from nodlidar_bringup.checks.report import as_json, faults, print_sections, Section
from nodlidar_common.command_line import LineParser
from nodlidar_common.errors import ParameterError
from rich.console import Console

LONGEST = 3600.0  # s


def main(argv: Sequence[str] | None) -> int:
    """Examine everything; return 1 if there is a fault, otherwise 0."""
    options = _parse(argv)
    if not 0.0 < options.seconds <= LONGEST:
        raise ParameterError('--seconds', f'above 0 and at most {LONGEST:g} s', options.seconds)
    network = network_facts(os.environ)
    if network.middleware not in network.installed:
        os.environ.pop('RMW_IMPLEMENTATION', None)  # ROS would end the process

    from nodlidar_bringup.ros.examination import examine

    sections = [Section('network', check_network(network)), *examine(options)]
    if options.json:
        print(as_json(sections))
    else:
        print_sections(sections, Console(highlight=False))
    return 1 if faults(sections) else 0


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('doctor', __doc__)
    parser.add_argument('--lidar-port', metavar='PORT', help='port of the lidar')
    parser.add_argument('--servo-port', metavar='PORT', help='port of the servo')
    parser.add_argument('--baud-rate', type=int, metavar='BIT/S', help='bit rate of the servo')
    parser.add_argument('--servo-id', type=int, metavar='ID', help='ID of the servo')
    parser.add_argument('--namespace', default='', help='namespace of the sensor')
    parser.add_argument(
        '--frame-prefix',
        help="prefix of the sensor's frames [default: that of the running assembler's frame]",
    )
    parser.add_argument(
        '--seconds',
        type=float,
        default=4.0,
        help='how long to listen to the running system [s]; longer for a slow nod',
    )
    parser.add_argument(
        '--no-ask', action='store_true', help='do not ask free ports which device is there'
    )
    parser.add_argument('--json', action='store_true', help='print a JSON object')
    return parser.parse_args(argv)
