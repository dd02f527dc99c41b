"""What the command doctor reads from the computer."""

import time

from nodlidar_bringup.checks import host_facts
from nodlidar_bringup.checks.host_facts import HostWatch
from nodlidar_bringup.checks.network_facts import network_facts


def test_the_environment_is_read(tmp_path):
    index = tmp_path / 'share/ament_index/resource_index/rmw_typesupport'
    index.mkdir(parents=True)
    (index / 'rmw_fastrtps_cpp').touch()
    facts = network_facts(
        {
            'AMENT_PREFIX_PATH': f'/nowhere:{tmp_path}',
            'ROS_DOMAIN_ID': '7',
            'RMW_IMPLEMENTATION': 'rmw_missing_cpp',
            'FASTRTPS_DEFAULT_PROFILES_FILE': str(tmp_path / 'missing.xml'),
            'ROS_LOCALHOST_ONLY': '1',
        },
        tmp_path,
    )
    assert facts.installed == ('rmw_fastrtps_cpp',)
    assert (facts.domain_id, facts.middleware) == ('7', 'rmw_missing_cpp')
    assert not facts.profiles_exist
    assert facts.localhost_only
    assert facts.shared_memory > 0.0


def test_the_load_is_the_share_of_all_cores_that_is_in_use():
    watch = HostWatch()
    deadline = time.monotonic() + 0.3
    while time.monotonic() < deadline:  # one core
        pass
    facts = watch.facts(nodes_run=False)
    assert 0.8 / facts.cores < facts.busy <= 1.0
    assert abs(facts.clock_step) < 0.01
    assert facts.yardstick > 0.0


def test_driver_and_governor_of_the_frequency_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(host_facts, 'CPU_FREQUENCY', tmp_path)
    assert HostWatch().facts(nodes_run=True).governor == ''
    (tmp_path / 'scaling_governor').write_text('powersave\n')
    (tmp_path / 'scaling_driver').write_text('intel_pstate\n')
    facts = HostWatch().facts(nodes_run=True)
    assert (facts.governor, facts.frequency_driver) == ('powersave', 'intel_pstate')
    assert facts.nodes_run
