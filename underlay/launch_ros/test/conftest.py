from launch import LaunchDescription, LaunchService
import pytest


@pytest.fixture(autouse=True)
def _log_directory(tmp_path_factory, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path_factory.mktemp('log')))


@pytest.fixture
def launch(capsys):
    """Launch entities, and return the exit code and what was printed."""

    def run(*entities, noninteractive=True):
        service = LaunchService(noninteractive=noninteractive)
        service.include_launch_description(LaunchDescription(entities))
        return service.run(), capsys.readouterr().out

    return run
