"""`ros2 run nodlidar_assembler assemble_bag`: makes the clouds of a recorded bag.

They are those that the assembler node makes of the same messages, by the same parameters.
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Assemble a bag; return the exit status."""

    def work() -> None:
        # Imported here: a package that is missing is told in a line.
        from nodlidar_assembler.bags.command import assemble

        assemble(argv, __doc__)

    return run('assemble_bag', work)


if __name__ == '__main__':
    sys.exit(main())
