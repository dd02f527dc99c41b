"""How the error depends on the servo's feedback: its rate and the resolution of the encoder.

An RX-24F by physics, whose loop has the same feedback, with its encoder or a finer one that is no
more linear; and an ideal servo beside it.
"""

from dataclasses import replace
from itertools import product
import math

from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, PitchEstimator
from nodlidar_sim.simulation import Recording
from nodlidar_sim.world.device_section import load_servo
from nodlidar_sim.world.servo.parameters import ServoParameters

from bench.errors.accuracy import MIXED_PIXEL_ANGLE, pitch_rms, points_rms
from bench.shared.reference import DEFAULT_N_S, joints_at, real_room, simulated_room
from bench.shared.report import Row

DURATION = 20.0
RATES = (20.0, 62.0, 100.0, 200.0)
# Of the RX-24F, 300 degrees in 1024 steps, and of the MX-28, 360 degrees in 4096.
TICKS = {10: math.radians(300.0) / 1024, 12: math.tau / 4096}
ESTIMATORS = ('nearest', 'slerp', 'trajectory')
REAL, IDEAL = 'RX-24F', 'ideal servo'
TITLE = (
    f'Feedback of the servo: RMS pitch errors in the room, {DURATION:.0f} s at N_s = '
    f'{DEFAULT_N_S}; points with a URG-04LX-UG01, slerp, filtered'
)


def results() -> list[Row]:
    """Return the RMS errors of estimators by the rate and the bits of the encoder."""
    return [_row(rate, bits) for rate, bits in product(RATES, TICKS)]


def column(estimator: str, servo: str) -> str:
    """Return the heading of an estimator's pitch error with a servo."""
    return f'{estimator}, {servo} [mrad]'


def _row(rate: float, bits: int) -> Row:
    sensor = replace(joints_at(rate), joint_tick=TICKS[bits])
    real = real_room(DURATION, sensor, servo=_servo(TICKS[bits]))
    ideal = simulated_room(DURATION, sensor=sensor)
    return {
        'joint states [Hz]': rate,
        'encoder [bits]': bits,
        **_errors(real, REAL),
        'distance of the points [mm]': points_rms(real, 'slerp', MIXED_PIXEL_ANGLE) * 1e3,
        **_errors(ideal, IDEAL),
    }


def _servo(tick: float) -> ServoParameters:
    """Return an RX-24F with another step of its encoder [rad].

    Its noise is as many steps; nonlinearity and compliance margin are as many radians.
    """
    servo = load_servo('rx24f')
    ratio = servo.tick / tick
    return replace(
        servo,
        tick=tick,
        encoder_nonlinearity=servo.encoder_nonlinearity * ratio,
        margin=servo.margin * ratio,
    )


def _errors(simulated: Recording, servo: str) -> Row:
    return {
        column(name, servo): 1e3
        * pitch_rms(simulated, PitchEstimator(EstimatorConfig(estimator=name)))
        for name in ESTIMATORS
    }
