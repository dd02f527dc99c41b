"""The error of each estimator in the room, encoder steps and reversals included."""

from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, ESTIMATORS, PitchEstimator
from nodlidar_demo.evaluation import (
    FAR,
    near_beams,
    points_of,
    simulated_log,
    surface_rms,
)
from nodlidar_sim.simulation import Recording
import numpy as np

from bench.reference import simulated_room
from bench.report import Row

DURATION = 40.0
REVERSAL_ERRORS = (0.0, 0.003, 0.008)
TITLE = (
    f'Accuracy in the room, {DURATION:.0f} s at N_s = 4001, span 1.2272 rad, joint states at 62 Hz'
)


def results() -> list[Row]:
    """Return the errors of pitch and of the points, by estimator."""
    recordings = {error: simulated_room(DURATION, error) for error in REVERSAL_ERRORS}
    exact = recordings[0.0]
    near = near_beams(simulated_log(exact))
    return [
        {
            'estimator': estimator,
            **{
                f'RMS pitch error, reversals {error * 1e3:.0f} ms off [mrad]': pitch_rms(
                    r, PitchEstimator(EstimatorConfig(estimator=estimator))
                )
                * 1e3
                for error, r in recordings.items()
            },
            f'RMS distance to the surfaces, beams up to {FAR:g} m [mm]': surface_rms(
                points_of(near, estimator), exact.world
            )
            * 1e3,
        }
        for estimator in ESTIMATORS
    ]


def pitch_rms(simulated: Recording, estimator: PitchEstimator) -> float:
    """Return the RMS error of the beams' pitch [rad], against that of a perfect encoder."""
    offset = np.arange(len(simulated.azimuth), dtype=np.float64) * simulated.sensor.time_increment
    log = simulated_log(simulated)
    errors = []
    for times_ns, true in zip(simulated.true_time_ns, simulated.true_encoder_pitch, strict=True):
        margin_ns = estimator.margin_ns
        around = log.samples_around(times_ns[0] - margin_ns, times_ns[-1] + margin_ns)
        samples = log.sample_ns[around], log.sample_pitch[around]
        errors.append(estimator.pitch(int(times_ns[0]), offset, *samples) - true)
    return float(np.sqrt(np.mean(np.square(errors))))
