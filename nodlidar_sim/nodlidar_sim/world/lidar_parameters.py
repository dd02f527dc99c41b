"""The errors of a lidar."""

from __future__ import annotations

from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_common.parameters import check, parameter
from nodlidar_sim.world.raycast import PLAIN
import numpy as np


@dataclass(frozen=True, slots=True)
class LidarParameters:
    """The errors of a lidar; every effect is off, and costs nothing, at 0.

    Which errors there are: Kneip, Tache, Caprari, Siegwart, "Characterization of the compact
    Hokuyo URG-04LX 2D laser range scanner", ICRA 2009; Okubo, Ye, Borenstein, "Characterization
    of the Hokuyo URG-04LX laser rangefinder for mobile robot obstacle negotiation", 2009.
    """

    noise: float = parameter(
        0.0, 'Standard deviation of a range close by', unit='m', minimum=0.0, maximum=1.0
    )
    noise_growth: float = parameter(
        0.0, 'Standard deviation of a far range, per metre', minimum=0.0, maximum=0.5
    )
    brightness_bias: float = parameter(
        0.0, 'Excess range of a black surface', unit='m', minimum=-0.5, maximum=0.5
    )
    incidence_bias: float = parameter(
        0.0, 'Excess range at grazing incidence', unit='m', minimum=-0.5, maximum=0.5
    )
    offset: float = parameter(
        0.0, 'Excess range of all surfaces', unit='m', minimum=-0.5, maximum=0.5
    )
    elevation: float = parameter(
        0.0,
        'Angle at which beams rise out of the plane in which it turns',
        unit='rad',
        minimum=-0.2,
        maximum=0.2,
    )
    divergence: float = parameter(
        0.0, 'Angle of the cone that the beam is', unit='rad', minimum=0.0, maximum=0.1
    )
    least_echo: float = parameter(
        0.0,
        'Echo below which a beam is lost: brightness times cosine of incidence by range squared',
        unit='1/m^2',
        minimum=0.0,
        maximum=10.0,
    )
    echo_scatter: float = parameter(
        0.0, 'Relative standard deviation of the echo', minimum=0.0, maximum=1.0
    )
    warm_up_drift: float = parameter(
        0.0, 'Excess range when it is switched on', unit='m', minimum=-0.5, maximum=0.5
    )
    warm_up_time: float = parameter(
        1800.0, 'Time constant of the drift', unit='s', minimum=1.0, maximum=100000.0
    )
    on_for: float = parameter(
        0.0, 'Time since it was switched on, at the start', unit='s', minimum=0.0, maximum=1e6
    )

    def __post_init__(self) -> None:
        check(self)

    @property
    def senses_echoes(self) -> bool:
        """Whether an effect depends on the brightness or the incidence of a surface."""
        return any((self.brightness_bias, self.incidence_bias, self.divergence, self.least_echo))

    @property
    def ideal(self) -> bool:
        """Whether every effect is off."""
        own = (self.noise, self.noise_growth, self.warm_up_drift, self.offset, self.elevation)
        return not (any(own) or self.senses_echoes)

    def sigma(self, ranges: Array) -> Array:
        """Return the standard deviation of the noise [m] at ranges [m], shape (n,) as theirs."""
        return np.asarray(np.hypot(self.noise, self.noise_growth * ranges))

    def bias(self, brightness: Array, cosine: Array) -> Array:
        """Return the excess range [m] by brightness and cosine of incidence, shape (n,) each."""
        return np.asarray(
            self.brightness_bias * (1.0 - brightness / PLAIN)
            + self.incidence_bias * (1.0 - cosine)
        )

    def drift(self, elapsed: Array) -> Array:
        """Return the excess range [m] at times [s] after the start, shape (n,) as theirs."""
        decay = np.exp(-(self.on_for + elapsed) / self.warm_up_time)
        return np.asarray(self.warm_up_drift * decay)
