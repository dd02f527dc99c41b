"""DDS discovery: how soon the nodes find each other."""

import os

from nodlidar_bringup.ros.shared_files import share

# Fast DDS reads its profiles from the first up to ROS 2 Jazzy, from the second since Kilted.
PROFILE_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')


def announce_often() -> None:
    """Make this process and its children announce themselves every 0.5 s instead of every 3 s.

    Fast DDS can miss a publisher that is created while two participants discover each other, until
    the next announcement. Profiles that the user has set are kept.
    """
    if any(variable in os.environ for variable in PROFILE_VARIABLES):
        return
    for variable in PROFILE_VARIABLES:
        os.environ[variable] = share('nodlidar_bringup', 'config/fast_discovery.xml')
