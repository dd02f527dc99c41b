"""`ros2 run nodlidar_assembler assemble_bag`: assembles the clouds of a recorded bag.

The clouds are those that the assembler node publishes for the same messages and parameters.
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Assemble a bag; return the exit status."""

    def work() -> None:
        # Imported here, so that `run` reports a missing package in one line.
        from nodlidar_assembler.bags.command import assemble

        assemble(argv, __doc__)

    return run('assemble_bag', work)


if __name__ == '__main__':
    sys.exit(main())
