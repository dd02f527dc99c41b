"""The launch file's arguments: what follows from them, and what a wrong value leads to."""

import os
from pathlib import Path

from nodlidar_bringup.ros.launched import launched_sensor, STOP_TIMEOUT
from observer import Observer
import pytest
from rclpy.qos import ReliabilityPolicy
import yaml


def test_rviz_shows_clouds_where_they_do_not_move(tmp_path, monkeypatch):
    """By a program in place of RViz that writes its arguments down."""
    told = tmp_path / 'told'
    index = tmp_path / 'share' / 'ament_index' / 'resource_index' / 'packages'
    program = tmp_path / 'lib' / 'rviz2' / 'rviz2'
    for folder in (index, program.parent):
        folder.mkdir(parents=True)
    (index / 'rviz2').touch()
    program.write_text(f'#!/bin/sh\necho "$@" >{told}.new && mv {told}.new {told}\n')
    program.chmod(0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    with launched_sensor(tmp_path / 'launch.log', 'rviz:=true', 'ego_motion:=beam') as running:
        observer = Observer()
        observer.spin_until(lambda: told.exists() or not running.running(), 'RViz')
        observer.close()
    words = told.read_text().split()
    config = Path(words[words.index('-d') + 1])
    assert words[words.index('-f') + 1] == 'odom'
    view = yaml.safe_load(config.read_text())['Visualization Manager']['Views']['Current']
    assert view['Target Frame'] == 'base_link'


def test_best_effort_scans_are_taken_in_a_namespace(tmp_path):
    observer = Observer()
    given = 'lidar:=ydlidar', 'servo:=none', 'description:=none', 'namespace:=/left/'
    with launched_sensor(tmp_path / 'launch.log', 'hardware:=real', *given):
        heard = lambda: observer.node.get_subscriptions_info_by_topic('/left/scan')  # noqa: E731
        observer.spin_until(heard, 'the assembler')
        qos = [each.qos_profile.reliability for each in heard()]
    assert qos == [ReliabilityPolicy.BEST_EFFORT]
    observer.close()


def ended(log, *arguments):
    """Return the log of a launch that ends by itself, with an exit status that says so."""
    with launched_sensor(log, *arguments) as running:
        assert running.process.wait(STOP_TIMEOUT) == 1
        return log.read_text()


@pytest.mark.parametrize(
    ('argument', 'words'),
    [
        ('laser_xyz:=0 0', "'laser_xyz' must be three numbers [m], separated by spaces"),
        ('rviz:=true', "package 'rviz2' is not installed"),
        ('hardware:=toy', 'Argument "hardware" provided value "toy" is not valid'),
    ],
)
def test_a_wrong_argument_is_named_in_one_line_before_anything_starts(tmp_path, argument, words):
    text = ended(tmp_path / 'launch.log', argument)
    line = [line for line in text.splitlines() if words in line][-1]
    assert '[ERROR] [launch]' in line
    assert 'process started' not in text
    assert 'Traceback' not in text


def test_contradictions_in_the_assembler_s_file_end_the_launch_before_anything_starts(tmp_path):
    file = tmp_path / 'assembler.yaml'
    file.write_text('/**: {ros__parameters: {pitch_min: 0.7, samples_per_sweeps: 4001}}\n')
    text = ended(tmp_path / 'launch.log', f'assembler_params:={file}')
    assert "'pitch_max' must be at least" in text
    assert text.count("there is no parameter 'samples_per_sweeps'") == 1
    assert 'process started' not in text
    assert 'Traceback' not in text
