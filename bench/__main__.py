"""Prints every measurement: `python -m bench`, or some: `python -m bench accuracy`."""

import argparse
from pathlib import Path
import sys

from rich import get_console
from rich.console import Console

from bench import (
    accuracy,
    assemble_bag,
    bandwidth,
    calibration,
    clouds,
    coverage_feedback,
    devices,
    drawn_buildings,
    effects,
    ego_motion,
    error_budget,
    estimators,
    faults,
    feedback_loop,
    hot_paths,
    late_odometry,
    level_scan,
    lidar_clock,
    limit_changes,
    live,
    mapping,
    network,
    network_clouds,
    network_discovery,
    nod_schedules,
    odometry_jumps,
    pareto,
    phase_lock,
    pitch_compensation,
    pitch_motions,
    planner_speed,
    processor_time,
    profiles,
    published_choice,
    published_repeats,
    scan_region,
    sensing,
    servos,
    sigma,
    slam,
    stages,
    standard_packages,
    unsteady_lidars,
    veils,
    viewer,
)
from bench.names import parsed
from bench.page import fill_pages
from bench.report import commit, record, recorded, recording, table

MEASUREMENTS = {
    'hot_paths': hot_paths,
    'assemble_bag': assemble_bag,
    'accuracy': accuracy,
    'pareto': pareto,
    'effects': effects,
    'live': live,
    'processor_time': processor_time,
    'bandwidth': bandwidth,
    'calibration': calibration,
    'network': network,
    'network_clouds': network_clouds,
    'network_discovery': network_discovery,
    'faults': faults,
    'profiles': profiles,
    'stages': stages,
    'estimators': estimators,
    'pitch_motions': pitch_motions,
    'sensing': sensing,
    'clouds': clouds,
    'ego_motion': ego_motion,
    'error_budget': error_budget,
    'mapping': mapping,
    'drawn_buildings': drawn_buildings,
    'odometry_jumps': odometry_jumps,
    'late_odometry': late_odometry,
    'level_scan': level_scan,
    'viewer': viewer,
    'unsteady_lidars': unsteady_lidars,
    'lidar_clock': lidar_clock,
    'slam': slam,
    'scan_region': scan_region,
    'coverage_feedback': coverage_feedback,
    'feedback_loop': feedback_loop,
    'nod_schedules': nod_schedules,
    'servos': servos,
    'devices': devices,
    'phase_lock': phase_lock,
    'limit_changes': limit_changes,
    'pitch_compensation': pitch_compensation,
    'planner_speed': planner_speed,
    'standard_packages': standard_packages,
    'veils': veils,
    'sigma': sigma,
    'published_choice': published_choice,
    'published_repeats': published_repeats,
}


def main() -> None:
    """Print the requested measurements, by default all; record them on request."""
    parser = argparse.ArgumentParser(prog='python -m bench', description=__doc__)
    parser.add_argument(
        '--record',
        action='store_true',
        help='write results into bench/results and the pages that show them',
    )
    parser.add_argument(
        '--compare',
        action='store_true',
        help='report what became slower than recorded; the exit status is then 1',
    )
    parser.add_argument(
        '--against',
        type=Path,
        metavar='FOLDER',
        help='another version, built there: processor_time, which needs it, measures it, too',
    )
    arguments = parsed(parser, MEASUREMENTS)
    console = get_console()
    if arguments.compare:
        sys.exit(_compare(console))
    measured_at = commit()
    for name in arguments.names:
        if name == 'processor_time' and arguments.against is None:
            console.print('processor_time: left out, since it needs --against')
            continue
        measurement = MEASUREMENTS[name]
        with console.status(name):
            rows = measurement.results(*_of_another_version(name, arguments.against))
        console.print(table(measurement.TITLE, rows, console.width))
        if arguments.record:
            record(name, recording(rows, measurement.TITLE, measured_at))
    if arguments.record:
        fill_pages()


def _of_another_version(name: str, against: Path | None) -> list[Path]:
    return [against] if name == 'processor_time' and against else []


def _compare(console: Console) -> int:
    """Print what became slower than recorded; return 1 if anything did."""
    before = recorded('hot_paths')
    with console.status('hot_paths'):
        rows = hot_paths.comparison(hot_paths.results(), before['rows'])
    title = f'Against {before["commit"]} of {before["date"]}'
    console.print(table(title, rows, console.width))
    return int(any(row[hot_paths.VERDICT] for row in rows))


if __name__ == '__main__':
    main()
