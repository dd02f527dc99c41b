"""What each estimator costs in accuracy, in the room, encoder steps and turn-arounds included."""

from nodlidar_assembler.geometry import REFERENCE_MOUNT
from nodlidar_assembler.pitch_estimator import ESTIMATORS, PitchEstimator
from nodlidar_bringup.evaluation import (
    FAR,
    MAX_JOINT_GAP,
    near_beams,
    points_of,
    simulated_log,
    surface_rms,
)
from nodlidar_sim.simulation import Recording
import numpy as np
from rich.table import Table

from bench.reference import simulated_room

DURATION = 40.0
TURN_ERRORS = (0.0, 0.003, 0.008)


def table() -> Table:
    """Return the errors of pitch and of the points' places, by estimator."""
    recordings = [simulated_room(DURATION, error) for error in TURN_ERRORS]
    simulated = recordings[0]
    near = near_beams(simulated_log(simulated))
    result = Table(
        title=f'Accuracy in the room, {DURATION:.0f} s at N_s = 4001, span 1.2272 rad, '
        'joint states at 62 Hz'
    )
    result.add_column('estimator')
    result.add_column('RMS pitch error', justify='right')
    for error in TURN_ERRORS[1:]:
        result.add_column(f'with turns {error * 1e3:.0f} ms off', justify='right')
    result.add_column(f'RMS distance to the surfaces, beams up to {FAR:g} m', justify='right')
    for estimator in ESTIMATORS:
        rms = surface_rms(points_of(near, estimator, REFERENCE_MOUNT), simulated.world)
        errors = [f'{pitch_rms(r, estimator) * 1e3:.2f} mrad' for r in recordings]
        result.add_row(estimator, *errors, f'{rms * 1e3:.1f} mm')
    return result


def pitch_rms(simulated: Recording, estimator: str) -> float:
    """Return the RMS error of the beams' pitch [rad]."""
    offset = np.arange(len(simulated.azimuth)) * simulated.sensor.time_increment
    told = PitchEstimator(estimator, MAX_JOINT_GAP)
    log = simulated_log(simulated)
    errors = []
    for times_ns, true in zip(simulated.true_time_ns, simulated.true_pitch, strict=True):
        around = log.samples_around(times_ns[0] - told.margin_ns, times_ns[-1] + told.margin_ns)
        samples = log.sample_ns[around], log.sample_pitch[around]
        errors.append(told.pitch(int(times_ns[0]), offset, *samples) - true)
    return float(np.sqrt(np.mean(np.square(errors))))
