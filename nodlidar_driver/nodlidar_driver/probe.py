"""The command `probe`: what a lidar is, how fast it scans, how well it is dated, what it sees.

It reads some seconds of scans. The laser of a Hokuyo is off afterwards, also after Ctrl-C or an
error; an LD06 or LD19 takes no commands.
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Probe a lidar; return the exit status."""

    def work() -> None:
        # Imported here, so that `run` reports a missing package in one line.
        from nodlidar_driver.probe_command import probe

        probe(argv, __doc__)

    return run('probe', work)


if __name__ == '__main__':
    sys.exit(main())
