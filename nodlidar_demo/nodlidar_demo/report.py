"""The tables at the end of the demo."""

from collections.abc import Mapping
import math

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_demo.delivery import Delivery
from nodlidar_demo.evaluation import FAR
import numpy as np
from rich.console import Console
from rich.table import Table


def print_report(
    log: SensorLog,
    delivery: Delivery,
    rms: Mapping[str, float],
    rms_by_odometry: Mapping[str, float],
    lidar: float,
    console: Console,
) -> None:
    """Print what a recorded sensor delivered, and the accuracy of each estimator.

    The RMS distances [m] are by true poses of the base and by odometry; the latter are empty for a
    base that does not drive. `lidar` is what the lidar's errors alone cause.
    """
    console.print(_delivery_table(log, delivery))
    console.print(rms_table(rms, rms_by_odometry, lidar))


def _delivery_table(log: SensorLog, delivery: Delivery) -> Table:
    table = Table(title='Delivered', show_header=False)
    table.add_column()
    table.add_column(justify='right')
    table.add_row('scans', f'{len(log.scans)}')
    table.add_row('beams', f'{sum(len(scan.ranges) for scan in log.scans)}')
    table.add_row('joint samples', f'{len(log.sample_ns)}')
    table.add_row('clouds', f'{delivery.clouds}')
    table.add_row('points', f'{delivery.points}')
    for reason, count in delivery.dropped.items():
        table.add_row(f'dropped: {reason}', f'{count}')
    if not delivery.dropped:
        table.add_row('dropped', '0')
    if len(delivery.latency):
        median, high = np.percentile(delivery.latency, [50, 99]) * 1e3
        table.add_row('latency, last byte to cloud: p50', f'{median:.1f} ms')
        table.add_row('latency, last byte to cloud: p99', f'{high:.1f} ms')
    for name, value in nod_rows(delivery):
        table.add_row(name, value)
    return table


def nod_rows(delivery: Delivery) -> list[tuple[str, str]]:
    """Return how the nod was adapted to the range, in words: first and last, and changes."""
    if not len(delivery.nods):
        return []
    ends = [f'{low:+.2f} to {high:+.2f} rad' for low, high, _ in delivery.nods[[0, -1]]]
    samples = [f'{n_s:.0f}' for n_s in delivery.nods[[0, -1], 2]]
    return [
        ('limits of the nod at first', ends[0]),
        ('limits of the nod at last', ends[1]),
        ('N_s, first and last', ', '.join(samples)),
        ('changes of limits or N_s', f'{len(delivery.nods) - 1}'),
    ]


def rms_table(
    rms: Mapping[str, float], by_odometry: Mapping[str, float], lidar: float = 0.0
) -> Table:
    """Return the table of RMS distances [m] by estimator; see print_report.

    An estimator's share is what remains of its squared distance without that of the lidar.
    """
    best = min(rms.values())
    table = Table(title=f'RMS distance to the true surfaces, beams up to {FAR:g} m')
    headings = ['estimator', 'RMS', 'against the best']
    if by_odometry:
        headings = ['estimator', 'by true poses', 'against the best', 'by odometry']
    if lidar:
        headings.append('without the lidar')
    for heading in headings:
        table.add_column(heading, justify='left' if heading == 'estimator' else 'right')
    for estimator, distance in rms.items():
        row = [estimator, f'{distance * 1e3:.1f} mm', f'{distance / best:.1f} x']
        if by_odometry:
            row.append(f'{by_odometry[estimator] * 1e3:.1f} mm')
        if lidar:
            row.append(f'{math.sqrt(max(distance**2 - lidar**2, 0.0)) * 1e3:.1f} mm')
        table.add_row(*row)
    if lidar:
        table.caption = f"Of each, the lidar's own errors are {lidar * 1e3:.1f} mm"
    return table
