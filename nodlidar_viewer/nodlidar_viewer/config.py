"""Parameters of the viewer."""

from dataclasses import dataclass

from nodlidar_common.parameters import parameter


@dataclass(frozen=True)
class ViewerConfig:
    """Viewer."""

    host: str = parameter(
        '0.0.0.0',
        'Address on which the page is served; 0.0.0.0: on all networks of this machine; '
        '127.0.0.1: on this machine only',
    )
    port: int = parameter(
        8080,
        'TCP port of the page; if it is taken, the next free one',
        minimum=1024,
        maximum=65_535,
    )
    remote_control: bool = parameter(
        False,
        'Whether browsers on other machines may control the sensor; if false, they only look',
    )
    fixed_frame: str = parameter(
        'base_link', 'Frame that stands still on the page, such as base_link, odom or map'
    )
    sensor_frame: str = parameter(
        'nodlidar_base_link', 'Frame of the nod axis, from which directions are counted'
    )
    most_points: int = parameter(
        55_000,
        'Points of the latest clouds that the page shows',
        minimum=1000,
        maximum=1_000_000,
    )
    most_map_points: int = parameter(
        60_000,
        'Points of a map that the page shows; of more, an even share',
        minimum=1000,
        maximum=1_000_000,
    )
    frame_rate: float = parameter(
        7.0,
        'Pictures per second that the page is sent, at most',
        unit='Hz',
        minimum=1.0,
        maximum=30.0,
    )
