"""Scans a simulated scene, measures the clouds and draws them: `ros2 run nodlidar_demo demo`."""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo; return the exit status."""

    def work() -> None:
        # Imported here, so that a missing package is reported in one line.
        from nodlidar_demo.ros.demonstration import demonstrate

        demonstrate(argv, __doc__)

    return run('demo', work)


if __name__ == '__main__':
    sys.exit(main())
