"""Reads how ROS communicates on this computer."""

from collections.abc import Mapping
import os
from pathlib import Path

from nodlidar_bringup.checks.network import Network


def network_facts(environment: Mapping[str, str], shared: Path = Path('/dev/shm')) -> Network:
    """Return what the environment says."""
    profiles = environment.get('FASTDDS_DEFAULT_PROFILES_FILE') or environment.get(
        'FASTRTPS_DEFAULT_PROFILES_FILE', ''
    )
    return Network(
        environment.get('ROS_DOMAIN_ID', ''),
        environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE', ''),
        environment.get('RMW_IMPLEMENTATION', ''),
        profiles,
        _middlewares(environment),
        Path(profiles).is_file(),
        environment.get('ROS_LOCALHOST_ONLY') == '1',
        _free(shared),
    )


def _middlewares(environment: Mapping[str, str]) -> tuple[str, ...]:
    """Return the installed middlewares, by the index of ament."""
    folders = [Path(part) for part in environment.get('AMENT_PREFIX_PATH', '').split(':') if part]
    index = 'share/ament_index/resource_index/rmw_typesupport'
    names = {path.name for folder in folders for path in (folder / index).glob('rmw_*')}
    return tuple(sorted(names))


def _free(folder: Path) -> float | None:
    try:
        status = os.statvfs(folder)
    except OSError:
        return None
    return float(status.f_bavail * status.f_frsize)
