"""The error budget of a plan: as a table, for JSON and as a picture."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from nodlidar_planner.error_budget.budget import beams_at, budget_of, SOURCES
from nodlidar_planner.error_budget.parameters import ErrorParameters
from nodlidar_planner.pattern.task import Task
from nodlidar_planner.plan_scan.words import number
import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

DISTANCES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)
CURVE = 60  # distances of the picture
# The delays have the same error where the robot stands.
_LINES: dict[str, Any] = {
    'scan delay': {'linestyle': '--'},
    'total': {'color': 'black', 'linewidth': 2.5},
}


@dataclass(frozen=True, slots=True)
class ErrorReport:
    """The RMS error of points by distance and source.

    Attributes
    ----------
    pitch
        RMS error of the estimated pitch [rad].
    distances
        Of the surfaces [m].
    rms
        RMS errors [m] at each distance, by source, and 'total'.
    parameters
        The data of the devices.
    """

    pitch: float
    distances: Sequence[float]
    rms: dict[str, list[float]]
    parameters: ErrorParameters


def error_report(
    task: Task,
    speed: float,
    parameters: ErrorParameters,
    distances: Sequence[float] | None = None,
) -> ErrorReport:
    """Return the error budget of a nod with a speed [rad/s].

    The distances [m] are by default DISTANCES and the task's.

    Raises
    ------
    ParameterError
        If the acceleration of the reversals is too low for the nod.
    """
    budget = budget_of(task, speed, parameters)
    if distances is None:
        distances = sorted({*DISTANCES, task.distance})
    found = [budget.rms(beams_at(task, distance)) for distance in distances]
    rms = {name: [each[name] for each in found] for name in (*SOURCES, 'total')}
    return ErrorReport(math.sqrt(budget.pitch_variance), distances, rms, parameters)


def print_error_report(report: ErrorReport, console: Console) -> None:
    """Print the RMS errors [mm], a row per source."""
    title = f'RMS error of a point [mm], pitch estimated to {number(report.pitch * 1e3)} mrad'
    table = Table(box=box.SIMPLE, title=title, title_justify='left')
    table.add_column('source')
    for distance in report.distances:
        table.add_column(f'at {number(distance)} m', justify='right')
    for name, values in report.rms.items():
        if name == 'total':
            table.add_section()
        table.add_row(name, *(f'{value * 1e3:.1f}' for value in values))
    console.print(table)


def error_json(report: ErrorReport) -> dict[str, Any]:
    """Return a report as an object for JSON, in SI units."""
    rms = {name.replace(' ', '_'): values for name, values in report.rms.items()}
    return {'distances': list(report.distances), 'pitch_error': report.pitch, 'rms': rms}


def write_error_picture(path: Path, task: Task, speed: float, parameters: ErrorParameters) -> None:
    """Draw the RMS errors over the distance.

    Raises
    ------
    OSError
        If the file cannot be written.
    ParameterError
        As `error_report`.
    """
    # Imported here, since importing matplotlib takes as long as everything else.
    from matplotlib.figure import Figure
    from nodlidar_planner.plan_scan.pictures import save

    farthest = max(DISTANCES[-1], 1.25 * task.distance)
    distances = np.linspace(farthest / CURVE, farthest, CURVE).tolist()
    report = error_report(task, speed, parameters, distances)
    figure = Figure(figsize=(9, 6), layout='constrained')
    axes = figure.subplots()
    for name, values in report.rms.items():
        if max(values) > 0.0:
            line = _LINES.get(name, {})
            axes.plot(distances, [value * 1e3 for value in values], label=name, **line)
    axes.set(xlabel='distance [m]', ylabel='RMS error of a point [mm]', xlim=(0.0, farthest))
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    save(figure, axes, path)
