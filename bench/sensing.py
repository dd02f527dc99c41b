"""How the error depends on the servo's feedback: its rate and the resolution of the encoder."""

from itertools import product
import math

from nodlidar_assembler.clouds.pitch_estimator import EstimatorConfig, PitchEstimator
from nodlidar_sim.world.sensor_model import SensorModel

from bench.accuracy import pitch_rms
from bench.reference import REVERSAL_ERROR, simulated_room
from bench.report import Row

DURATION = 20.0
RATES = (20.0, 62.0, 100.0, 200.0)
# Of the RX-24F, 300 degrees in 1024 steps, and of the MX-28, 360 degrees in 4096.
TICKS = {10: math.radians(300.0) / 1024, 12: math.tau / 4096}
ESTIMATORS = ('nearest', 'slerp', 'trajectory')
TITLE = (
    f'Feedback of the servo: the room, {DURATION:.0f} s at N_s = 4001, '
    f'reversals {REVERSAL_ERROR * 1e3:.0f} ms off'
)


def results() -> list[Row]:
    """Return the RMS pitch error of estimators by the rate and the bits of the encoder."""
    return [
        {
            'joint states [Hz]': rate,
            'encoder [bits]': bits,
            **{f'{name} [mrad]': rms * 1e3 for name, rms in _errors(rate, TICKS[bits]).items()},
        }
        for rate, bits in product(RATES, TICKS)
    ]


def _errors(rate: float, tick: float) -> dict[str, float]:
    sensor = SensorModel(joint_rate=rate, joint_tick=tick)
    simulated = simulated_room(DURATION, REVERSAL_ERROR, sensor)
    return {
        name: pitch_rms(simulated, PitchEstimator(EstimatorConfig(estimator=name)))
        for name in ESTIMATORS
    }
