"""The band of heights that matters to a robot on the floor."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter


@dataclass(frozen=True)
class BandConfig:
    """Band of heights."""

    band_bottom: float = parameter(
        0.1,
        'Lower end of the band of heights above the floor; lower points do not count',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    band_top: float = parameter(
        2.0,
        'Upper end of the band of heights',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )
    sensor_height: float = parameter(
        1.08,
        'Height of the optical centre above the floor at pitch 0; robot.launch.py takes it from '
        'mount_xyz and laser_xyz',
        unit='m',
        minimum=-100.0,
        maximum=100.0,
    )

    def check_together(self) -> None:
        """Raise ParameterError for a band of heights without a height."""
        if self.band_top <= self.band_bottom:
            limit = f'above band_bottom = {self.band_bottom} m'
            raise ParameterError('band_top', limit, self.band_top)
