"""A sensor whose driver and servo run on one machine and the assembler on another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, ExitStack
from dataclasses import dataclass
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any, Protocol, TypeVar

from ament_index_python.packages import get_package_prefix
from nodlidar_common.errors import NodlidarError
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.world.effects import imperfect
from nodlidar_sim.world.ideal_servo import IdealServo
from nodlidar_sim.world.world import World

from bench.faults.fault_truth import Truth
from bench.network.network_judgement import are_decided
from bench.network.network_listener import Arrival, arrivals
from bench.shared.noisy_room import noisy_room, switching_soon, terminals

TIMEOUT, STOP_TIMEOUT = 60.0, 10.0  # s
HERE = ['scan=sensor_msgs/msg/LaserScan', 'joint_states=sensor_msgs/msg/JointState']
THERE = ['points=sensor_msgs/msg/PointCloud2', '/diagnostics=diagnostic_msgs/msg/DiagnosticArray']

Result = TypeVar('Result')


class Place(Protocol):
    """Where processes run."""

    def run(self, function: Callable[[], Result]) -> Result:
        """Call a function there."""


@dataclass(frozen=True, slots=True)
class Site:
    """A place, and the variables of the environment of the nodes there."""

    place: Place
    environment: dict[str, str]


class TooLateError(NodlidarError):
    """What is waited for did not come in time."""


class NetworkRig:
    """Emulated devices of this process, the nodes on two sites, and a listener on each.

    Parameters
    ----------
    folder
        For the devices' links, the output of the nodes and what arrived.
    robot, far
        The sites.
    parameters
        Parameters of the assembler, as for ``--ros-args -p``.

    Attributes
    ----------
    truth
        What the devices truly did.
    """

    def __init__(
        self, folder: Path, robot: Site, far: Site, parameters: Sequence[str] = ()
    ) -> None:
        self.folder, self._robot, self._far = folder, robot, far
        self._parameters = ['mixed_pixel_angle:=0.0', *parameters]
        room, motion, start_ns = noisy_room(), IdealServo(), time.time_ns()
        self.truth = Truth(motion)
        world = World(room, motion, start_ns=start_ns)
        lidar = UrgEmulator(imperfect(world.ranges, room.effects, 1), start_ns=start_ns)
        lidar.on_scan = lambda turn: self.truth.add_scan(turn, True)
        servo = RxServoEmulator(motion, baud=1)
        self._ports = terminals({'lidar': lidar, 'servo': servo}, folder)

    @contextmanager
    def running(self) -> Iterator[NetworkRig]:
        """Run everything until the context ends."""
        with ExitStack() as stack:
            stack.enter_context(switching_soon())
            for port in self._ports.values():
                stack.enter_context(port)
            stack.enter_context(listening(self._robot, self.folder / 'here', HERE))
            stack.enter_context(listening(self._far, self.folder / 'there', THERE))
            stack.enter_context(self._node(self._far, 'assembler', self._parameters))
            stack.enter_context(self._node(self._robot, 'servo', self._device('servo')))
            driver = self._node(self._robot, 'driver', self._device('lidar'))
            self._driver = stack.enter_context(driver)
            yield self

    def _device(self, name: str) -> list[str]:
        return [f'port:={self.folder / name}', 'autostart:=true']

    def until_clouds(self, count: int) -> None:
        """Wait until so many clouds have come; raises TooLateError if they do not."""
        self._until(
            lambda: sum(each.topic == 'points' for each in self.there()) >= count,
            f'{count} clouds have not come',
        )

    def end_scans(self) -> None:
        """End the driver, and wait until the assembler has reported what became of each scan.

        The servo goes on, so that the last scans are still bracketed. Raises TooLateError.
        """
        _end(self._driver)
        self._until(lambda: are_decided(self.there()), 'scans are undecided')

    @staticmethod
    def _until(is_so: Callable[[], bool], otherwise: str) -> None:
        deadline = time.monotonic() + TIMEOUT
        while not is_so():
            if time.monotonic() > deadline:
                raise TooLateError(f'{otherwise} after {TIMEOUT:g} s')
            time.sleep(0.1)

    def here(self) -> Iterator[Arrival]:
        """Yield what arrived on the robot."""
        return arrivals(self.folder / 'here')

    def there(self) -> Iterator[Arrival]:
        """Yield what arrived on the far machine."""
        return arrivals(self.folder / 'there')

    def _node(
        self, site: Site, name: str, parameters: Sequence[str]
    ) -> AbstractContextManager[subprocess.Popen[bytes]]:
        package = f'nodlidar_{name}'
        program = Path(get_package_prefix(package)) / 'lib' / package / name
        given = [word for each in parameters for word in ('-p', each)]
        command = [str(program), '--ros-args', *given]
        return process_at(site, self.folder / f'{name}.log', command)


@contextmanager
def process_at(site: Site, log: Path, command: list[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a process on a site until the context ends; its output goes into a file."""
    with log.open('wb') as output:
        process = site.place.run(
            lambda: subprocess.Popen(
                command,
                env=os.environ | site.environment,
                cwd=Path(__file__).parents[2],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        )
    try:
        yield process
    finally:
        _end(process)


def listening(site: Site, file: Path, topics: list[str]) -> AbstractContextManager[Any]:
    """Run a listener to topics that writes into a file; see bench.network.network_listener."""
    command = [sys.executable, '-m', 'bench.network.network_listener', str(file), *topics]
    return process_at(site, file.with_suffix('.log'), command)


def talking(
    site: Site, log: Path, size: int, count: int, period: float, pause: float
) -> AbstractContextManager[Any]:
    """Run a node that publishes clouds; see bench.network.network_talker."""
    numbers = [f'{number}' for number in (size, count, period, pause)]
    return process_at(site, log, [sys.executable, '-m', 'bench.network.network_talker', *numbers])


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process as Ctrl-C does, by force if necessary."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
