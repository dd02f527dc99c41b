"""Fig. 8: a corner at pi rad/s, with one pitch for each scan and with one for each beam."""

from pathlib import Path

from matplotlib.axes import Axes
import matplotlib.pyplot as plt
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, ESTIMATORS, PitchEstimator
from nodlidar_assembler.clouds.points import Points
from nodlidar_common.arrays import Mask
from nodlidar_demo.evaluation import FAR, near_beams, points_of_log, surface_rms
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.simulation import simulate
from nodlidar_sim.world.scene import load_scene
import numpy as np
from rich.console import Console
from rich.table import Table

from bench.errors.accuracy import pitch_rms
from bench.shared.reference import reference_nod, START_NS
from bench.shared.report import Row, table
from figures.saving import save

DURATION = 10.0
# Half the thickness of the drawn slice [m]; the corner's edge lies straight ahead.
SLICE = 0.12
SHOWN = 'nearest', 'slerp'


def draw(folder: Path, console: Console) -> Table:
    """Draw the corner in profile into corner.png; return the errors of each estimator."""
    simulated = simulate(
        load_scene('corner', ideal=True), reference_nod(), DURATION, start_ns=START_NS
    )
    near = near_beams(simulated_log(simulated))
    rows: list[Row] = []
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(8.0, 5.0), sharex=True, sharey=True)
    for estimator in ESTIMATORS:
        points = points_of_log(near, estimator)
        rms, error = (
            surface_rms(points, simulated.world),
            pitch_rms(simulated, PitchEstimator(EstimatorConfig(estimator=estimator))),
        )
        rows.append(
            {
                'estimator': estimator,
                'RMS pitch error [mrad]': error * 1e3,
                'RMS distance to the surfaces [mm]': rms * 1e3,
            }
        )
        if estimator in SHOWN:
            _draw_profile(
                axes[SHOWN.index(estimator)], points, f'{estimator}: {rms * 1e3:.1f} mm RMS'
            )
    axes[0].legend(loc='upper left', markerscale=4)
    save(figure, folder / 'corner.png')
    return table(f'Fig. 8: a corner at pi rad/s, {DURATION:.0f} s, beams up to {FAR:g} m', rows)


def _going_up(points: Points) -> Mask:
    return reference_nod().velocity(points.time_ns) > 0.0


def _in_slice(points: Points) -> Mask:
    return np.asarray((np.abs(points.data['y']) < SLICE) & (points.data['x'] > 0.0))


def _draw_profile(axes: Axes, points: Points, title: str) -> None:
    """Draw a slice through the corner from the side, one colour for each direction of the nod."""
    up, shown = _going_up(points), _in_slice(points)
    for label, leg, colour in (('upward', up, 'tab:blue'), ('downward', ~up, 'tab:orange')):
        part = points.data[shown & leg]
        axes.plot(part['x'], part['z'], '.', color=colour, markersize=2, label=label)
    axes.set(title=title, xlabel='x [m]', ylabel='z [m]', aspect='equal')
