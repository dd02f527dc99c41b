"""Fixtures for the tests of the launch packages."""

import os

import pytest


@pytest.fixture
def launch(tmp_path_factory, monkeypatch, capsys):
    """Launch entities, and return the exit code and what was printed."""
    from launch import LaunchDescription, LaunchService

    def run(*entities, noninteractive=True):
        service = LaunchService(noninteractive=noninteractive)
        service.include_launch_description(LaunchDescription(entities))
        return service.run(), capsys.readouterr().out

    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path_factory.mktemp('log')))
    return run


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """Install a package 'sample' that has an executable 'echo'."""
    index = tmp_path / 'share/ament_index/resource_index/packages'
    library = tmp_path / 'lib/sample'
    for directory in (index, library, tmp_path / 'share/sample'):
        directory.mkdir(parents=True)
    (index / 'sample').touch()
    (library / 'echo').write_text('#!/bin/sh\necho "$@"\n')
    (library / 'echo').chmod(0o755)
    (library / 'data').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path}:{os.environ["AMENT_PREFIX_PATH"]}')
    return tmp_path
