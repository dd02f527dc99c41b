"""Every test run talks on a domain of its own, and only on this machine."""

import itertools
import os

import pytest

# The underlay's tests are of the underlay, which a sourced ROS takes the place of.
collect_ignore = [] if os.environ.get('NODLIDAR_UNDERLAY') else ['underlay']


@pytest.fixture(autouse=True, scope='session')
def isolated_domain():
    """Keep nodes of this run apart from those of any other run or robot."""
    # Imported here: modules without ROS are tested without it, too.
    from domain_coordinator import domain_id

    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    # Not always from 1 on: nodes of a run that was killed may still be there.
    candidates = itertools.count(os.getpid())
    with domain_id(lambda: next(candidates) % 100 + 1) as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        yield
