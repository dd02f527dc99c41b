"""The error of each estimator in the room: with the errors of real devices, and ideal.

The nod is the one that the assembler commands by default.
Those with real devices are means over several runs, whose noise differs. Pitch counts against what
a perfect encoder would report. Points count against the surfaces, so the backlash between encoder
and lidar and the errors of the ranges are in them.
"""

from nodlidar_assembler.clouds.mixed_pixels import MixedPixelConfig
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, ESTIMATORS, PitchEstimator
from nodlidar_demo.evaluation import FAR, near_beams, points_of_log, surface_rms
from nodlidar_demo.simulated_log import simulated_log
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world.device_section import load_lidar
from nodlidar_sim.world.lidar_parameters import LidarParameters
from nodlidar_sim.world.sensor_model import SensorModel
import numpy as np

from bench.shared.reference import DEFAULT_N_S, joints_at, real_room, simulated_room
from bench.shared.report import Row
from bench.shared.rms import rms

DURATION = 20.0
RATES = (62.0, 100.0)
BETTER = {
    'URG-04LX': load_lidar('urg_04lx'),
    'noise of 1 mm': LidarParameters(noise=0.001),
}
MIXED_PIXEL_ANGLE = MixedPixelConfig().mixed_pixel_angle
RATE = 'joint states [Hz]'
PITCH, IDEAL_PITCH = 'pitch, RX-24F [mrad]', 'pitch, ideal servo [mrad]'
REAL, FILTERED = 'URG-04LX-UG01 [mm]', 'URG-04LX-UG01, filtered [mm]'
SPREAD = 'filtered, deviation of runs [mm]'
GAIN, GAIN_SPREAD = 'filtered, gain over slerp [%]', 'deviation of the gain [%]'
IDEAL_LIDAR, IDEAL = 'ideal lidar [mm]', 'ideal lidar and servo [mm]'
SEEDS = range(6)
TITLE = (
    f'RMS errors in the room, {DURATION:.0f} s at N_s = {DEFAULT_N_S}, the default, RX-24F '
    f'by physics; of points [mm]: distance to the surfaces, beams up to {FAR:g} m; '
    f'filtered: mixed_pixel_angle = {MIXED_PIXEL_ANGLE:g}; '
    f'mean and standard deviation of {len(SEEDS)} runs'
)


def results() -> list[Row]:
    """Return the errors of pitch and of the points, by rate of the joint states and estimator."""
    return [row for rate in RATES for row in _rows(rate)]


def _rows(rate: float) -> list[Row]:
    sensor = joints_at(rate)
    runs = [_run(sensor, seed) for seed in SEEDS]
    ideal = simulated_room(DURATION, sensor=sensor)
    slerp = np.array([run['slerp'][FILTERED] for run in runs])
    rows: list[Row] = []
    for name in ESTIMATORS:
        means = {key: float(np.mean([run[name][key] for run in runs])) for key in runs[0][name]}
        filtered = np.array([run[name][FILTERED] for run in runs])
        row: Row = {
            RATE: rate,
            'estimator': name,
            **means,
            SPREAD: float(np.std(filtered, ddof=1)),
            IDEAL_PITCH: pitch_rms(ideal, PitchEstimator(EstimatorConfig(estimator=name))) * 1e3,
            IDEAL: points_rms(ideal, name) * 1e3,
        }
        if name == 'trajectory':
            gain = 100.0 * (1.0 - filtered / slerp)
            row |= {GAIN: float(np.mean(gain)), GAIN_SPREAD: float(np.std(gain, ddof=1))}
        rows.append(row)
    return rows


def _run(sensor: SensorModel, seed: int) -> dict[str, dict[str, float]]:
    """Return the errors by estimator in one run with an RX-24F and several lidars."""
    real = real_room(DURATION, sensor, seed=seed)
    exact = real_room(DURATION, sensor, seed=seed, lidar=LidarParameters())
    better = {
        f'{name}, filtered [mm]': real_room(DURATION, sensor, seed=seed, lidar=lidar)
        for name, lidar in BETTER.items()
    }
    return {
        name: {
            PITCH: pitch_rms(real, PitchEstimator(EstimatorConfig(estimator=name))) * 1e3,
            REAL: points_rms(real, name) * 1e3,
            FILTERED: points_rms(real, name, MIXED_PIXEL_ANGLE) * 1e3,
            **{
                lidar: points_rms(recording, name, MIXED_PIXEL_ANGLE) * 1e3
                for lidar, recording in better.items()
            },
            IDEAL_LIDAR: points_rms(exact, name) * 1e3,
        }
        for name in ESTIMATORS
    }


def points_rms(simulated: Recording, estimator: str, mixed_pixel_angle: float = 0.0) -> float:
    """Return the RMS distance [m] of the points to the true surfaces, of beams up to FAR."""
    log = near_beams(simulated_log(simulated))
    return surface_rms(points_of_log(log, estimator, mixed_pixel_angle), simulated.world)


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
    return rms(np.array(errors))
