"""A launch file as a child process: `ros2 launch nodlidar_bringup robot.launch.py`."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import shutil
import signal
import subprocess

from nodlidar_bringup.ros.discovery import announce_often

STOP_TIMEOUT = 20.0


class LaunchedSensor:
    """The running launch file; it ends when the thread that made it ends, even by SIGKILL.

    Attributes
    ----------
    log
        File with its output.
    process
        The `ros2 launch` process, leader of a session of its own.
    """

    def __init__(
        self,
        log: Path,
        *arguments: str,
        file: str = 'robot.launch.py',
        environment: dict[str, str] | None = None,
    ) -> None:
        self.log = log
        # A background job of a script ignores SIGINT, and launch would inherit that.
        command = ['env', '--default-signal=SIGINT', 'ros2', 'launch', 'nodlidar_bringup']
        command += [file, *arguments]
        if shutil.which('setpriv'):
            command = ['setpriv', '--pdeathsig', 'INT', *command]
        with log.open('wb') as output:
            # No terminal: launch assumes that its children got Ctrl-C from it, too.
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env=environment,
            )

    def running(self) -> bool:
        """Return whether the launch is still running."""
        return self.process.poll() is None

    def interrupt(self) -> int:
        """End the launch as Ctrl-C does; return its exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(STOP_TIMEOUT)

    def kill(self) -> None:
        """Kill the launch and all its nodes."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def keep_apart() -> None:
    """Isolate this process and its children in a ROS domain of their own.

    Environment variables that the user has set are kept. RViz joins with the same ROS_DOMAIN_ID.
    """
    announce_often()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))


@contextmanager
def launched_sensor(
    log: Path,
    *arguments: str,
    file: str = 'robot.launch.py',
    environment: dict[str, str] | None = None,
) -> Iterator[LaunchedSensor]:
    """Run a launch file with arguments like 'scene:=wall' until the context ends.

    The environment is by default that of this process.
    """
    sensor = LaunchedSensor(log, *arguments, file=file, environment=environment)
    try:
        yield sensor
    finally:
        if sensor.running():
            try:
                sensor.interrupt()
            except subprocess.TimeoutExpired:
                sensor.kill()
        # A launch that crashed may have left nodes behind; SIGTERM ends them cleanly.
        with suppress(ProcessLookupError):
            os.killpg(sensor.process.pid, signal.SIGTERM)
