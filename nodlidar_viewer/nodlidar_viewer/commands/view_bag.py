"""Replays a recording on a page in a browser.

Reads scans and joint states and, if there are any, transforms from odom, the frame of the clouds
then.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys
import time

from nodlidar_assembler.bags.bag_options import add_topics, configuration, topics_of
from nodlidar_assembler.bags.bag_topics import BagError, Topics
from nodlidar_assembler.bags.read_bag import read_bag, with_odometry
from nodlidar_assembler.bags.sensor_log import clouds_in
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.command_line import LineParser
from nodlidar_common.parameters import check
from nodlidar_viewer.config import ViewerConfig
from nodlidar_viewer.page import Page
from nodlidar_viewer.player import Player
from nodlidar_viewer.point_file import ply_bytes
from nodlidar_viewer.replay import Replay
from rich.console import Console

PERIOD = 0.1  # s, between two pictures


def main(argv: Sequence[str] | None) -> None:
    """Serve the page of a bag until Ctrl-C.

    Raises
    ------
    ParameterError
        For a parameter that is not allowed.
    BagError, OSError
        If the bag cannot be read, or no cloud be assembled.
    SystemExit
        After --help, or with status 2 and a line on stderr for an invalid option.
    """
    arguments = _parse(argv)
    config = ViewerConfig(host=arguments.host, port=arguments.port)
    check(config)
    with Console(stderr=True).status(f'assembling {arguments.bag}'):
        frame, clouds = _clouds_of(arguments.bag, arguments.params, topics_of(arguments))
    replay = Replay(clouds, config.most_points)
    page = Page(config, lambda: ('points.ply', ply_bytes(replay.recent.points, frame)))
    player = Player(page.gui, replay.duration)
    try:
        print(f'open {page.address} in a browser; Ctrl-C ends', flush=True)
        play(page, player, replay)
    except KeyboardInterrupt:
        page.stop()


def play(page: Page, player: Player, replay: Replay) -> None:
    """Show a recording as its player says, while a browser is connected."""
    last = time.monotonic()
    while True:
        time.sleep(PERIOD)
        now = time.monotonic()
        if page.is_watched:
            replay.move_to(player.move(now - last))
            with page.at_once():
                page.scene.show_cloud(replay.recent.chunks)
        last = now


def _clouds_of(bag: Path, params: Path | None, topics: Topics) -> tuple[str, list[Points]]:
    """Return the clouds of a bag and their frame: with odometry, that of odometry."""
    config = configuration(params, {})
    log = read_bag(bag, config, topics)
    try:
        log = with_odometry(log, bag, config, topics)
    except BagError as error:
        print(f'without odometry: {error}', file=sys.stderr)
        frame = config.frame_id
        config = configuration(params, {'ego_motion': 'off'})
    else:
        frame = config.odom_frame
        config = configuration(params, {'ego_motion': 'beam'})
    clouds, drops = clouds_in(log, config)
    for damage in log.damage:
        print(damage, file=sys.stderr)
    for reason, count in drops.items():
        print(f'dropped: {count} {reason}', file=sys.stderr)
    return frame, clouds


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = LineParser('view_bag', __doc__)
    parser.add_argument('bag', type=Path, help='a rosbag2 folder, or an .mcap or .db3 file')
    parser.add_argument('--params', type=Path, metavar='YAML', help='parameters of the assembler')
    add_topics(parser)
    parser.add_argument('--host', default='127.0.0.1', help='address of the page')
    parser.add_argument('--port', type=int, default=ViewerConfig.port, help='port of the page')
    return parser.parse_args(argv)
