"""The band of heights that matters to a robot on the floor."""

from collections.abc import Sequence
from dataclasses import dataclass

from nodlidar_common.arrays import Array
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_common.pose import Pose


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
    mount_tilt: tuple[float, float] = parameter(
        (0.0, 0.0),
        'Roll and pitch of frame_id on the level robot, as in mount_rpy, from which '
        'robot.launch.py takes them',
        unit='rad',
        minimum=-3.2,
        maximum=3.2,
    )

    @property
    def levelled(self) -> Array:
        """Rotation from frame_id to a level frame that looks the same way, shape (3, 3)."""
        return Pose.from_xyzrpy((0.0, 0.0, 0.0, *self.mount_tilt, 0.0)).rotation

    def axis_height(self, laser_xyz: Sequence[float]) -> float:
        """Return the height of the nod axis above the floor [m], given where the lidar is."""
        return self.sensor_height - float(self.levelled[2] @ laser_xyz)

    def check_together(self) -> None:
        """Raise ParameterError for a band of heights without a height, or a tilt of not two."""
        if len(self.mount_tilt) != 2:
            raise ParameterError('mount_tilt', 'two numbers', self.mount_tilt)
        if self.band_top <= self.band_bottom:
            limit = f'above band_bottom = {self.band_bottom} m'
            raise ParameterError('band_top', limit, self.band_top)
