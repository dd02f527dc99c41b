"""The command `plan_scan`, which chooses the nod that finds an object soonest."""

from collections.abc import Sequence
import sys

from nodlidar_common.command_line import run


def main(argv: Sequence[str] | None = None) -> int:
    """Plan a scan; return the exit status."""

    def work() -> None:
        # Imported here, so that a missing package is reported in one line.
        from nodlidar_planner.plan_scan.planning import plan_scan

        plan_scan(argv)

    return run('plan_scan', work)


if __name__ == '__main__':
    sys.exit(main())
