"""Scans a simulated scene, measures the clouds and draws them."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from nodlidar_common.command_line import LineParser
from nodlidar_demo.options import check_duration


def main(argv: Sequence[str] | None) -> None:
    """Run the demo; raises as `parse` and `demonstrate`."""
    from nodlidar_demo.ros.demonstration import demonstrate

    demonstrate(parse(argv))


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of a command line; raises ParameterError or SystemExit."""
    parser = LineParser('demo', __doc__)
    parser.add_argument('--scene', default='room', help='a scene of nodlidar_sim or a YAML file')
    parser.add_argument('--route', help="route of the base, in place of the scene's own")
    parser.add_argument(
        '--ideal', action='store_true', help='switch all errors of devices and odometry off'
    )
    parser.add_argument('--duration', type=float, default=20.0, help='seconds of clouds to record')
    parser.add_argument(
        '--output', type=Path, default=Path('demo_output'), help='folder for the results'
    )
    options = parser.parse_args(argv)
    check_duration(options.duration)
    return options
