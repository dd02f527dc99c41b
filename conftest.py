"""Every test run talks on a domain of its own, and only on this machine."""

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
    with domain_id() as domain:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        yield
