"""`ros2 run nodlidar_assembler plan_scan`: the old name of the planner's command."""

import sys

from nodlidar_planner.plan_scan import command


def main() -> int:
    """Print the new name and run the command."""
    sys.stderr.write('plan_scan has moved: use `ros2 run nodlidar_planner plan_scan`\n')
    return command.main()
