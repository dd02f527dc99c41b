"""`ros2 run nodlidar_viewer view_bag`: replays a recording on a page in a browser.

Reads scans and joint states and, if there are any, transforms from odom, the frame of the clouds
then.
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Serve the page until Ctrl-C; return the exit status."""

    def work() -> None:
        # Imported here, so that `run` reports a missing package in one line.
        from nodlidar_viewer.replay_command import replay_bag

        replay_bag(argv, __doc__)

    return run('view_bag', work)


if __name__ == '__main__':
    sys.exit(main())
