"""Every test file talks on a domain of its own, and only on this machine.

In `make test`, tests of a package that start nodes run one after the other: they mostly wait,
so that three tests at once keep two cores busy.
"""

import gc
import itertools
import os
from pathlib import Path
import re

from hypothesis import HealthCheck, settings
import pytest

# The underlay's tests are of the underlay, which a sourced ROS takes the place of.
collect_ignore = [] if os.environ.get('NODLIDAR_UNDERLAY') else ['underlay']

# No test may fail because a machine is slow or busy.
settings.register_profile(
    'any machine', deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile('any machine')

# Not always from 1 on: nodes of a run that was killed may still be there.
DOMAINS = itertools.count(os.getpid())

# Of Fast DDS up to ROS 2 Jazzy, and since Kilted.
PROFILE_VARIABLES = 'FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE'
LOOPBACK = Path(__file__).parent / 'tools/loopback.xml'
# A program that a test waits for to its end, subprocess.run, may run beside others.
STARTS_NODES = re.compile(
    '(import|from) rclpy|node_bench|launched_sensor|LaunchedSensor|NetworkRig|Popen|ExecuteProcess'
)


@pytest.hookimpl(tryfirst=True)  # pytest-xdist reads the marks in the same hook
def pytest_collection_modifyitems(config, items):
    """Keep the tests of a file together, and those of a package that start nodes."""
    if not config.pluginmanager.hasplugin('xdist'):
        return
    groups = {}
    for item in items:
        if item.path not in groups:
            starts_nodes = STARTS_NODES.search(Path(item.path).read_text())
            package = item.path.relative_to(config.rootpath).parts[0]
            groups[item.path] = package if starts_nodes else str(item.path)
        item.add_marker(pytest.mark.xdist_group(groups[item.path]))


def pytest_collection_finish():
    """Leave what lives as long as the tests out of every collection of garbage, to save time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True, scope='module')
def isolated_domain():
    """Keep nodes of this file apart from those of any other file, run or robot.

    A node that a test kills is still seen for some seconds.
    """
    # Imported here: modules without ROS are tested without it, too.
    from domain_coordinator import domain_id
    from rclpy.utilities import get_rmw_implementation_identifier

    if get_rmw_implementation_identifier() == 'rmw_fastrtps_cpp':
        # The range LOCALHOST always uses shared memory. See the file for why these tests do not.
        os.environ.update(dict.fromkeys(PROFILE_VARIABLES, str(LOOPBACK)))
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SYSTEM_DEFAULT'
    else:
        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with domain_id(lambda: next(DOMAINS) % 100 + 1) as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        yield
