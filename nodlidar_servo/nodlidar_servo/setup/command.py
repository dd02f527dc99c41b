"""The command `setup`: finds a servo, shows what it is, and sets it up for the servo node.

It asks before each change, writes with the torque off, reads back, and ends with the command that
starts the nod. It never moves the motor.
"""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Set a servo up; return the exit status."""

    def work() -> None:
        # Imported here, so that `run` reports a missing package in one line.
        from nodlidar_servo.setup.terminal import set_up

        set_up(argv, __doc__)

    return run('setup', work)


if __name__ == '__main__':
    sys.exit(main())
