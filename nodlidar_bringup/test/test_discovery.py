"""How soon the nodes find each other."""

import os
import subprocess
import sys
from xml.etree import ElementTree

from ament_index_python.packages import get_package_share_directory
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_bringup.ros.discovery import announce_often, PROFILE_VARIABLES
import pytest

_NODE = 'import rclpy; rclpy.init(); rclpy.create_node("one").destroy_node(); rclpy.shutdown()'


@pytest.fixture(autouse=True)
def _no_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, 'environ', os.environ.copy())
    for variable in PROFILE_VARIABLES:
        os.environ.pop(variable, None)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'  # what the profile saw to


def _complaints_of_a_node() -> str:
    """Return what Fast DDS says of its file of profiles when a node starts."""
    command = [sys.executable, '-c', _NODE]
    printed = subprocess.check_output(command, env=dict(os.environ), text=True)
    return '\n'.join(line for line in printed.splitlines() if 'XML' in line)


def test_fast_dds_takes_our_file() -> None:
    announce_often()
    assert not _complaints_of_a_node()


def test_a_message_that_was_missed_is_sent_again_before_a_scan_waits_too_long_for_it() -> None:
    announce_often()
    file = ElementTree.parse(os.environ[PROFILE_VARIABLES[0]])
    writers = [each for each in file.iter() if each.tag.endswith('data_writer')]
    assert [each.get('is_default_profile') for each in writers] == ['true']
    [period] = [each for each in writers[0].iter() if each.tag.endswith('heartbeatPeriod')]
    seconds, nanoseconds = (int(each.text or '') for each in period)
    assert seconds + nanoseconds / 1e9 < AssemblerConfig().deadline


def test_fast_dds_takes_the_file_for_lossy_networks() -> None:
    share = get_package_share_directory('nodlidar_bringup')
    for variable in PROFILE_VARIABLES:
        os.environ[variable] = os.path.join(share, 'config', 'lossy_network.xml')
    assert not _complaints_of_a_node()


def test_fast_dds_reads_the_file_that_the_variable_names(tmp_path) -> None:
    announce_often()
    broken = tmp_path / 'broken.xml'
    with open(os.environ[PROFILE_VARIABLES[0]]) as file:
        broken.write_text(file.read().replace('leaseAnnouncement', 'leaseAnnounce'))
    for variable in PROFILE_VARIABLES:
        os.environ[variable] = str(broken)
    assert 'leaseAnnounce' in _complaints_of_a_node()


@pytest.mark.parametrize('variable', PROFILE_VARIABLES)
def test_the_users_file_stays(variable: str) -> None:
    os.environ[variable] = 'mine.xml'
    announce_often()
    assert [os.environ.get(each) for each in PROFILE_VARIABLES].count('mine.xml') == 1
    assert sum(each in os.environ for each in PROFILE_VARIABLES) == 1
