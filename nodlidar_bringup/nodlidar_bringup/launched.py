"""A launched sensor as a child process: `ros2 launch nodlidar_bringup robot.launch.py`."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import signal
import subprocess

from nodlidar_bringup.discovery import announce_often

STOP_TIMEOUT = 20.0


class LaunchedSensor:
    """The running launch file.

    Attributes
    ----------
    log
        What it prints.
    process
        The process of `ros2 launch`, which leads a session of its own.
    """

    def __init__(self, log: Path, *arguments: str) -> None:
        self.log = log
        # What a script starts in the background ignores Ctrl-C, and launch would leave it at that.
        command = ['env', '--default-signal=SIGINT', 'ros2', 'launch', 'nodlidar_bringup']
        command += ['robot.launch.py', *arguments]
        with log.open('wb') as output:
            # Without a terminal: launch takes its children to have got a Ctrl-C from one.
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def running(self) -> bool:
        """Tell whether it still runs."""
        return self.process.poll() is None

    def interrupt(self) -> int:
        """End it as Ctrl-C would; return its exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(STOP_TIMEOUT)

    def kill(self) -> None:
        """Kill it and all that it started."""
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def keep_apart() -> None:
    """Keep this process and its children apart from other nodes, unless the user said where to be.

    RViz can look on with the same ROS_DOMAIN_ID.
    """
    announce_often()
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))


@contextmanager
def launched_sensor(log: Path, *arguments: str) -> Iterator[LaunchedSensor]:
    """Run the launch file with arguments like 'scene:=wall' until the context ends."""
    sensor = LaunchedSensor(log, *arguments)
    try:
        yield sensor
    finally:
        if sensor.running():
            try:
                sensor.interrupt()
            except subprocess.TimeoutExpired:
                sensor.kill()
        # A launch that died may have left nodes; they end cleanly by this.
        with suppress(ProcessLookupError):
            os.killpg(sensor.process.pid, signal.SIGTERM)
