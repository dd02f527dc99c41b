"""The parameters of the mapper node; those of its stages stand beside what uses them."""

from dataclasses import dataclass

from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_mapper.graph.loops import LoopConfig
from nodlidar_mapper.output.grid import GridConfig
from nodlidar_mapper.tracking.track import TrackConfig


@dataclass(frozen=True)
class NodeConfig:
    """Node."""

    cloud_topics: tuple[str, ...] = parameter(
        ('points',),
        'Topics of deskewed clouds (profile slam), one for each sensor on the robot',
    )
    map_frame: str = parameter('map', 'Frame of the map')
    odom_frame: str = parameter('odom', 'Frame of odometry: TF has the pose of base_frame in it')
    base_frame: str = parameter('base_link', 'Frame of the robot, whose pose is published')
    odometry_deadline: float = parameter(
        0.5,
        'Longest time that a cloud waits for odometry at its stamp',
        unit='s',
        minimum=0.01,
        maximum=10.0,
    )
    odometry_delay: float = parameter(
        0.0,
        'Delay of odometry stamps after the measurement; set it in the assembler, too',
        unit='s',
        minimum=-1.0,
        maximum=1.0,
    )
    odometry_period: float = parameter(
        0.0,
        'Period of odometry whose stamps jitter; set it in the assembler, too',
        unit='s',
        minimum=0.0,
        maximum=1.0,
    )
    transform_tolerance: float = parameter(
        0.2,
        'The transform from map_frame to odom_frame is stamped so far ahead, so that it is never '
        'late',
        unit='s',
        minimum=0.0,
        maximum=10.0,
    )
    map_folder: str = parameter(
        '',
        'Folder of a saved map to be loaded, in which the robot may be anywhere; if empty, a new '
        'map begins',
    )
    save_folder: str = parameter(
        '',
        'Folder for maps. Each has a folder of its own in it, named by the time, and is saved '
        'when the node ends or another map begins, its keyframes.npz every 30 s as well; if '
        'empty, maps are not saved',
    )
    map_period: float = parameter(
        5.0,
        'Time between two publications of a map that grows; drawing it never takes more than a '
        'fifth of the time',
        unit='s',
        minimum=0.5,
        maximum=600.0,
    )

    def check_together(self) -> None:
        """Raise ParameterError for topics or frames that are the same, or none."""
        topics = set(self.cloud_topics)
        if not topics or '' in topics or len(topics) < len(self.cloud_topics):
            raise ParameterError('cloud_topics', 'at least one, all different', self.cloud_topics)
        frames = {'map_frame': self.map_frame, 'odom_frame': self.odom_frame}
        for key, other in (
            ('odom_frame', 'map_frame'),
            ('base_frame', 'map_frame'),
            ('base_frame', 'odom_frame'),
        ):
            limit = f"a frame other than {other} = '{frames[other]}'"
            if getattr(self, key) in ('', frames[other]):
                raise ParameterError(key, limit, getattr(self, key))


@dataclass(frozen=True)
class MapConfig(LoopConfig, TrackConfig):
    """Map."""

    extend_map: bool = parameter(
        True,
        'Extend the map while the robot drives; false: only find the robot in the map of '
        'map_folder',
    )
    keyframe_distance: float = parameter(
        0.5,
        'Way after which there is a new keyframe, if the robot does not turn',
        unit='m',
        minimum=0.05,
        maximum=10.0,
    )
    keyframe_angle: float = parameter(
        0.5,
        'Turn after which there is one, if it stays in place; shares of both add up',
        unit='rad',
        minimum=0.05,
        maximum=3.0,
    )
    least_share: float = parameter(
        0.4,
        'Share of the points near the map that must match; with fewer, the robot counts as lost',
        minimum=0.05,
        maximum=1.0,
    )
    least_clear: float = parameter(
        0.8,
        'Share of the points that must not be in space that was seen to be free; with fewer, the '
        'robot counts as lost',
        minimum=0.05,
        maximum=1.0,
    )


@dataclass(frozen=True)
class MapperConfig(GridConfig, MapConfig, NodeConfig):
    """All parameters of the node."""
