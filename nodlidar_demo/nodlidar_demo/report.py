"""The tables at the end of the demo."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from nodlidar_assembler.bags.sensor_log import SensorLog
from nodlidar_common.terminal import summary_table
from nodlidar_demo.delivery import Delivery
from nodlidar_demo.evaluation import FAR
import numpy as np
from rich.console import Console
from rich.table import Table


@dataclass(frozen=True, slots=True)
class Distances:
    """RMS distances of the points to the true surfaces [m], by estimator.

    Attributes
    ----------
    rms
        By true poses of the base.
    filtered
        The same without mixed pixels.
    by_odometry
        By odometry; empty for a base that does not drive.
    lidar
        What the lidar's errors alone cause, without mixed pixels. These are so few and so far off
        that two recordings differ by more than an estimator's share.
    """

    rms: Mapping[str, float]
    filtered: Mapping[str, float] = field(default_factory=dict)
    by_odometry: Mapping[str, float] = field(default_factory=dict)
    lidar: float = 0.0


def print_report(
    log: SensorLog, delivery: Delivery, distances: Distances, console: Console
) -> None:
    """Print what a recorded sensor delivered, and the accuracy of each estimator."""
    console.print(summary_table(_delivery_rows(log, delivery), title='Delivered'))
    console.print(rms_table(distances))


def _delivery_rows(log: SensorLog, delivery: Delivery) -> list[tuple[str, object]]:
    return [
        ('scans', len(log.scans)),
        ('beams', sum(len(scan.ranges) for scan in log.scans)),
        ('joint samples', len(log.sample_ns)),
        ('clouds', delivery.clouds),
        ('points', delivery.points),
        *((f'dropped: {reason}', count) for reason, count in delivery.dropped.items()),
        *([] if delivery.dropped else [('dropped', 0)]),
        *_latency_rows(delivery),
        *nod_rows(delivery),
    ]


def _latency_rows(delivery: Delivery) -> list[tuple[str, str]]:
    if not len(delivery.latency):
        return []
    median, high = np.percentile(delivery.latency, [50, 99]) * 1e3
    return [
        ('latency, last byte to cloud: p50', f'{median:.1f} ms'),
        ('latency, last byte to cloud: p99', f'{high:.1f} ms'),
    ]


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


def rms_table(distances: Distances) -> Table:
    """Return the table of RMS distances by estimator."""
    lidar, best = distances.lidar, min(distances.rms.values())
    table = Table(title=f'RMS distance to the true surfaces, beams up to {FAR:g} m')
    columns = {
        'estimator': {name: name for name in distances.rms},
        'by true poses' if distances.by_odometry else 'RMS': _in_mm(distances.rms),
        'against the best': {e: f'{own / best:.1f} x' for e, own in distances.rms.items()},
        'by odometry': _in_mm(distances.by_odometry),
        'without mixed pixels': _in_mm(distances.filtered),
    }
    shown = {heading: values for heading, values in columns.items() if values}
    for heading in shown:
        table.add_column(heading, justify='left' if heading == 'estimator' else 'right')
    for estimator in distances.rms:
        table.add_row(*(values[estimator] for values in shown.values()))
    if lidar:
        table.caption = (
            f"The lidar's errors alone, drawn anew: {lidar * 1e3:.1f} mm without mixed pixels"
        )
    return table


def _in_mm(distances: Mapping[str, float]) -> dict[str, str]:
    return {name: f'{distance * 1e3:.1f} mm' for name, distance in distances.items()}
