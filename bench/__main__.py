"""Prints every measurement: `python -m bench`, or some: `python -m bench accuracy`."""

from rich.console import Console

from bench import (
    accuracy,
    assembly_time,
    coverage_feedback,
    ego_motion,
    limit_changes,
    live,
    nod_schedules,
    phase_lock,
    pitch_compensation,
    planner_speed,
    simulation_speed,
)
from bench.names import names_from_command_line

MEASUREMENTS = {
    'assembly_time': assembly_time.table,
    'accuracy': accuracy.table,
    'simulation_speed': simulation_speed.table,
    'live': live.table,
    'ego_motion': ego_motion.table,
    'coverage_feedback': coverage_feedback.table,
    'nod_schedules': nod_schedules.table,
    'phase_lock': phase_lock.table,
    'limit_changes': limit_changes.table,
    'pitch_compensation': pitch_compensation.table,
    'planner_speed': planner_speed.table,
}


def main() -> None:
    """Print the tables that were asked for, by default all."""
    names = names_from_command_line('python -m bench', str(__doc__), MEASUREMENTS)
    console = Console()
    for name in names:
        with console.status(name):
            result = MEASUREMENTS[name]()
        console.print(result)


if __name__ == '__main__':
    main()
