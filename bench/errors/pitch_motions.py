"""The pitch of the beams on motions that no estimator assumes, and on servos by physics.

Motions in closed form start from the reference nod with reversals of 200 rad/s^2. The error counts
against what the encoder would report without steps and noise; what backlash and its nonlinearity
add, which no joint sample shows, stands beside. Figures of servos are means over encoders.
"""

from collections.abc import Callable
from dataclasses import replace
import math
import time

from nodlidar_assembler.clouds.pitch import PitchError
from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, PitchEstimator
from nodlidar_common.arrays import Array, Times
from nodlidar_common.stamps import NS_PER_S
from nodlidar_sim.nodding import nodding_servo
from nodlidar_sim.world.device_section import load_servo, servo_names
from nodlidar_sim.world.nod_motion import triangle_motion
from nodlidar_sim.world.sensor_model import SensorModel
from nodlidar_sim.world.servo.parameters import ServoParameters
import numpy as np

from bench.shared.reference import reference_nod, SPAN, START_NS
from bench.shared.report import Row
from bench.shared.rms import means, rms

Position = Callable[[Times], Array]

DURATION = 40.0
SETTLING = 3.0  # of an estimator that learns [s]
FIRST = 5  # scan, before which there are too few joint states for all margins
RATES = (62.0, 100.0)  # of the joint states, as through an adapter with a latency of 16 or 1 ms
JITTER = 5e-4  # of stamps, RMS [s]
NOISY = 1.0  # noise of an encoder, RMS [steps]; the sets have 0.3
FILTER_STEP = 1e-4  # s
VIBRATION_STEP = 5e-4  # s
VIBRATIONS = 200  # frequencies of a band
ENCODERS = range(4)  # seeds
RATIO = 'trajectory to slerp'
TITLE = f'RMS pitch error by motion, {DURATION:.0f} s at N_s = 4001; encoders of RX-24F and servos'


def results() -> list[Row]:
    """Return the RMS pitch errors of slerp and trajectory, by motion and rate."""
    closed = [
        _row(name, rate, motion, motion, _rounded(motion))
        for rate in RATES
        for name, motion in motions().items()
    ]
    lagging = motions()['lag of 10 ms']
    name = f'lag of 10 ms, stamps off by {JITTER * 1e3:g} ms RMS'
    late = [_row(name, rate, lagging, lagging, _rounded(lagging), JITTER) for rate in RATES]
    servos = [
        _servo_row(f'servo {name}', load_servo(name), rate)
        for rate in RATES
        for name in servo_names()
    ]
    noisy = replace(load_servo('rx24f'), encoder_noise=NOISY)
    name = 'servo rx24f, noise of a step'
    return closed + late + servos + [_servo_row(name, noisy, rate) for rate in RATES]


def motions() -> dict[str, Position]:
    """Return the motions in closed form: pitch [rad] at times [ns]."""
    nod = reference_nod()
    end_ns = START_NS + round((DURATION + 1.0) * NS_PER_S)
    ideal = triangle_motion(nod, START_NS - NS_PER_S, end_ns).position

    def warped(times_ns: Times) -> Array:
        pitch = ideal(times_ns)
        warp = 0.03 * SPAN / np.pi / 2.0 * np.sin(2.0 * np.pi * pitch / SPAN)
        return np.asarray(pitch + warp)

    def sine(times_ns: Times) -> Array:
        return np.asarray(-SPAN / 2.0 * np.cos(np.pi * nod.sweeps(times_ns)))

    return {
        'lines and parabolas (ideal)': ideal,
        **{f'lag of {ms:g} ms': _lagging(ideal, ms * 1e-3) for ms in (3.0, 10.0, 25.0)},
        'ripple, 2 mrad at 8 Hz': _rippled(ideal, 2e-3, 8.0),
        'ripple, 2 mrad at 20 Hz': _rippled(ideal, 2e-3, 20.0),
        'ripple, 4 mrad at 12 Hz': _rippled(ideal, 4e-3, 12.0),
        'vibration, 2 mrad at 37 Hz': _rippled(ideal, 2e-3, 37.0),
        'vibration, 4 mrad at 48 Hz': _rippled(ideal, 4e-3, 48.0),
        'vibration, 2 mrad RMS, 20 to 45 Hz': _shaken(ideal, 2e-3, 20.0, 45.0),
        'speed off by 3 % along the leg': warped,
        'sine': sine,
    }


def _rippled(ideal: Position, amplitude: float, frequency: float) -> Position:
    def position(times_ns: Times) -> Array:
        phase = 2.0 * np.pi * frequency * ((times_ns - START_NS) / NS_PER_S)
        return np.asarray(ideal(times_ns) + amplitude * np.sin(phase))

    return position


def _shaken(ideal: Position, deviation: float, lowest: float, highest: float) -> Position:
    """Return a motion with vibrations of many frequencies in a band [Hz]."""
    rng = np.random.default_rng(1)
    time_s = np.arange(-0.5, DURATION + 1.0, VIBRATION_STEP)
    shake = np.zeros(len(time_s))
    for frequency in np.linspace(lowest, highest, VIBRATIONS):
        shake += np.sin(2.0 * np.pi * (frequency * time_s + rng.uniform()))
    shake *= deviation / np.sqrt(VIBRATIONS / 2.0)

    def position(times_ns: Times) -> Array:
        return np.asarray(
            ideal(times_ns) + np.interp((times_ns - START_NS) / NS_PER_S, time_s, shake)
        )

    return position


def _lagging(ideal: Position, lag: float) -> Position:
    """Return a motion behind a first-order lag [s], by its impulse response."""
    past = np.arange(0.0, 12.0 * lag, FILTER_STEP)
    weight = np.exp(-past / lag)
    weight /= weight.sum()
    grid_ns = START_NS + np.arange(
        -NS_PER_S // 2, round(DURATION * NS_PER_S), round(FILTER_STEP * NS_PER_S)
    )
    lagged = np.convolve(ideal(grid_ns), weight)[: len(grid_ns)]

    def position(times_ns: Times) -> Array:
        return np.interp((times_ns - START_NS) / NS_PER_S, (grid_ns - START_NS) / NS_PER_S, lagged)

    return position


def _rounded(motion: Position) -> Position:
    tick = SensorModel().joint_tick

    def encoder(times_ns: Times) -> Array:
        return np.asarray(np.rint(motion(times_ns) / tick) * tick)

    return encoder


def _servo_row(name: str, parameters: ServoParameters, rate: float) -> Row:
    sensor = SensorModel(joint_rate=rate, joint_latency=0.0015 if rate > 62.0 else 0.016)
    end_ns = START_NS + round((DURATION + 1.0) * NS_PER_S)
    rows = []
    for seed in ENCODERS:
        servo = nodding_servo(parameters, reference_nod(), sensor, START_NS, end_ns, seed=seed)
        rows.append(_row(name, rate, servo.smooth_encoder, servo.position, servo.encoder))
    row = means(rows)
    return row | {RATIO: row['trajectory [mrad]'] / row['slerp [mrad]']}


def _row(
    name: str,
    rate: float,
    smooth: Position,
    lidar: Position,
    encoder: Position,
    jitter: float = 0.0,
) -> Row:
    """Return a row for a motion without the steps of the encoder, the lidar's, and the reports.

    Its stamps are off by `jitter` [s], RMS.
    """
    sample_s = np.arange(DURATION * rate) / rate
    sample_ns = START_NS + np.rint(sample_s * NS_PER_S).astype(np.int64)
    sample_pitch = encoder(sample_ns)
    off = np.random.default_rng(1).normal(0.0, jitter, len(sample_ns))
    sample_ns += np.rint(off * NS_PER_S).astype(np.int64)
    errors = {
        name: pitch_errors(EstimatorConfig(estimator=name), sample_ns, sample_pitch, smooth)
        for name in ('slerp', 'trajectory')
    }
    slerp, trajectory = (rms(error) for error, _ in errors.values())
    return {
        'motion': name,
        'joint states [Hz]': rate,
        'slerp [mrad]': slerp * 1e3,
        'trajectory [mrad]': trajectory * 1e3,
        RATIO: trajectory / slerp,
        'lidar to encoder, RMS [mrad]': rms(lidar(sample_ns) - smooth(sample_ns)) * 1e3,
        'time of trajectory [us]': errors['trajectory'][1] * 1e6,
    }


def pitch_errors(
    config: EstimatorConfig, sample_ns: Times, sample_pitch: Array, true: Position
) -> tuple[Array, float]:
    """Return the pitch errors of all beams [rad], and the median time of a scan [s].

    Errors are NaN where a scan is not placed. The first scans, of which an estimator learns, are
    left out.
    """
    sensor, estimate = SensorModel(), PitchEstimator(config)
    scans = round((DURATION - 1.0) / sensor.scan_time)
    beams_ns = sensor.beam_times_ns(START_NS, scans, 1.0)[FIRST:]
    pitches, times = [], []
    for times_ns in beams_ns:
        offset = (times_ns - times_ns[0]) / NS_PER_S
        first = np.searchsorted(sample_ns, times_ns[0] - estimate.margin_ns, side='right') - 1
        last = np.searchsorted(sample_ns, times_ns[-1] + estimate.margin_ns) + 1
        around = slice(first, last)
        samples = sample_ns[around], sample_pitch[around]
        begin = time.perf_counter()
        try:
            pitches.append(estimate.pitch(int(times_ns[0]), offset, *samples))
        except PitchError:
            pitches.append(np.full(len(times_ns), np.nan))
        times.append(time.perf_counter() - begin)
    settled = slice(math.ceil(SETTLING / sensor.scan_time), None)
    pairs = zip(pitches[settled], beams_ns[settled], strict=True)
    errors = [pitch - true(times_ns) for pitch, times_ns in pairs]
    return np.array(errors), float(np.median(times))
