"""The SCIP 2.0 lidars that are emulated: what they report, and how their beams lie."""

from dataclasses import dataclass
import math

from nodlidar_common.arrays import Array, Integers
import numpy as np


@dataclass(frozen=True, slots=True)
class ScipModel:
    """One model of lidar.

    Attributes
    ----------
    name, product, firmware
        As in the answers to PP, II and VV.
    steps_per_revolution, first_step, last_step, front_step
        Layout of the beams; first and last are those that are measured.
    last_requestable
        Last step that may be asked for.
    range_min_mm, range_max_mm
        Measurable ranges [mm].
    speed
        Of the motor [rpm].
    nothing, lost
        Codes for no surface in range, and for a lost beam.
    """

    name: str
    product: str
    firmware: str
    steps_per_revolution: int
    first_step: int
    last_step: int
    front_step: int
    last_requestable: int
    range_min_mm: int
    range_max_mm: int
    speed: int
    nothing: int
    lost: int

    @property
    def steps(self) -> Integers:
        """The measured steps, shape (n,)."""
        return np.arange(self.first_step, self.last_step + 1)

    @property
    def azimuths(self) -> Array:
        """The azimuth of each measured step [rad], shape (n,)."""
        step = math.tau / self.steps_per_revolution
        return np.asarray((self.steps - self.front_step) * step, dtype=np.float64)


# The answers of a recorded sensor; codes by the specification C-42-03320B.
URG_04LX_UG01 = ScipModel(
    name='URG-04LX-UG01(Simple-URG)(Hokuyo Automatic Co.,Ltd.)',
    product='SOKUIKI Sensor URG-04LX-UG01(Simple-URG)',
    firmware='3.4.03(17/Dec./2012)',
    steps_per_revolution=1024,
    first_step=44,
    last_step=725,
    front_step=384,
    last_requestable=768,
    range_min_mm=20,
    range_max_mm=5600,
    speed=600,
    nothing=0,
    lost=7,
)


def _of_1440_steps(name: str, range_mm: tuple[int, int], firmware: str) -> ScipModel:
    """Return a lidar of 270 degrees and 40 Hz.

    UST communication protocol specification C-42-04077, UTM-30LX specification C-42-03387: 65533
    is no echo, whatever the cause.
    """
    return ScipModel(
        name=name,
        product=f'SOKUIKI Sensor {name}',
        firmware=firmware,
        steps_per_revolution=1440,
        first_step=0,
        last_step=1080,
        front_step=540,
        last_requestable=1080,
        range_min_mm=range_mm[0],
        range_max_mm=range_mm[1],
        speed=2400,
        nothing=65533,
        lost=65533,
    )


SCIP_MODELS = {
    'URG-04LX-UG01': URG_04LX_UG01,
    'UST-10LX': _of_1440_steps('UST-10LX', (20, 30000), '1.2.1'),
    'UST-20LX': _of_1440_steps('UST-20LX', (20, 60000), '1.2.1'),
    'UTM-30LX': _of_1440_steps('UTM-30LX', (23, 60000), '1.20.02'),
}
