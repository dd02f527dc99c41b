"""The launched system on emulated devices of this process, which can make them fail."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
import time

from nodlidar_bringup.ros.launched import keep_apart, launched_sensor, LaunchedSensor
from nodlidar_sim.devices.device import Device
from nodlidar_sim.devices.faults import FaultyDevice
from nodlidar_sim.devices.faulty_line import FaultyLine
from nodlidar_sim.devices.rx_servo import RxServoEmulator
from nodlidar_sim.devices.rx_table import TORQUE_ENABLE
from nodlidar_sim.devices.urg import UrgEmulator
from nodlidar_sim.devices.urg_requests import Stream
from nodlidar_sim.devices.urg_scan import Revolution
from nodlidar_sim.world.effects import imperfect
from nodlidar_sim.world.faulty_servo import FaultyServo
from nodlidar_sim.world.world import World
import numpy as np
import psutil
import yaml

from bench.faults.fault_recorder import RecorderProcess
from bench.faults.fault_truth import Truth
from bench.shared.node_processes import node_processes
from bench.shared.noisy_room import noisy_room, switching_soon, terminals

# Every valid beam is a point, so that a cloud's true points are known.
ASSEMBLER_PARAMETERS = {'/**': {'ros__parameters': {'mixed_pixel_angle': 0.0}}}
START_TIMEOUT, STOP_TIMEOUT = 60.0, 10.0  # [s]


class WatchedDevice(FaultyDevice):
    """A device behind a bad connection that calls a function whenever its host is served."""

    def __init__(self, device: Device, seed: int, look: Callable[[int], None]) -> None:
        super().__init__(device, seed)
        self._look = look

    def transmit(self, now_ns: int) -> bytes:
        """Return what reaches the host."""
        data = super().transmit(now_ns)
        self._look(now_ns)
        return data


class Rig:
    """Emulated devices, the launched nodes and a recorder: a context manager.

    Parameters
    ----------
    folder
        For the bag, the devices' links and the output of launches.
    seed
        Of the random numbers of the devices.

    Attributes
    ----------
    truth
        What the devices truly did.
    lidar, servo, motion
        The devices, and the servo's motor with its encoder.
    recorder
        Records what the nodes publish.
    launch
        The running launch file.
    launches_ns
        When the launch file was started [ns].
    timer_error
        Added to the timestamp of the lidar's next scan, once [ms].
    timer_hit_ns
        When it was last added [ns].
    """

    recorder: RecorderProcess
    launch: LaunchedSensor

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder = folder
        self._assembler_params = folder / 'assembler.yaml'
        self._assembler_params.write_text(yaml.safe_dump(ASSEMBLER_PARAMETERS))
        self.launches_ns: list[int] = []
        self.timer_error = 0
        self.timer_hit_ns: int | None = None
        # Requested by a host that closed the port; the next host did not request it.
        self._unheard: Stream | None = None
        self._rng = np.random.default_rng(seed)
        start_ns = time.time_ns()
        self._scene = noisy_room()
        self.motion = FaultyServo(seed)
        self.truth = Truth(self.motion)
        self._world = World(self._scene, self.motion, start_ns=start_ns)
        self.servo = RxServoEmulator(self.motion, baud=1)
        self.wires = {
            'servo': self._wire(self.servo, self._look_at_servo),
            'lidar': self._new_lidar(start_ns),
        }
        self.ports = terminals(self.wires, folder)
        self._nodes: dict[str, psutil.Process] = {}
        self._stack = ExitStack()

    def __enter__(self) -> Rig:
        keep_apart()
        self._stack.enter_context(switching_soon())
        for port in self.ports.values():
            self._stack.enter_context(port)
        self.recorder = RecorderProcess(self.folder / 'bag')
        self._stack.callback(self.recorder.close)
        self._stack.callback(lambda: self._running.close())
        self.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._stack.close()

    # The devices.

    def line(self, device: str, direction: str) -> FaultyLine:
        """Return the line 'from' or 'to' a device."""
        wire = self.wires[device]
        return wire if direction == 'from' else wire.to_device

    def plug_in(self, device: str) -> None:
        """Plug in a device that was unplugged."""
        self.ports[device].reopen(device, self.wires[device])

    def unplug(self, device: str) -> None:
        """Unplug a device."""
        self.ports[device].close_device(device)

    def renew_lidar(self) -> None:
        """Restart the lidar, which must be unplugged."""
        self.wires['lidar'] = self._new_lidar(self.now_ns())

    def _new_lidar(self, start_ns: int) -> WatchedDevice:
        self.lidar = UrgEmulator(
            imperfect(self._world.ranges, self._scene.effects, int(self._rng.integers(2**31))),
            start_ns=start_ns,
            rotation_phase=float(self._rng.random()),
        )
        self.lidar.on_scan = self._scan_sent
        return self._wire(self.lidar, self._look_at_lidar)

    def _wire(self, device: Device, look: Callable[[int], None]) -> WatchedDevice:
        return WatchedDevice(device, int(self._rng.integers(2**31)), look)

    def _scan_sent(self, turn: Revolution) -> None:
        self.truth.add_scan(turn, self.lidar.sensor.stream is not self._unheard)
        if self.timer_error:
            turn.timer = (turn.timer + self.timer_error) % 2**24
            self.timer_error, self.timer_hit_ns = 0, turn.end_ns

    def _look_at_servo(self, now_ns: int) -> None:
        self.truth.torque.note(now_ns, bool(self.servo.table[TORQUE_ENABLE]))

    def _look_at_lidar(self, now_ns: int) -> None:
        self.truth.laser.note(now_ns, self.lidar.sensor.laser)
        if not self.ports['lidar'].in_use('lidar'):
            self._unheard = self.lidar.sensor.stream

    # The nodes.

    def start(self) -> None:
        """Start the launch file."""
        self.launches_ns.append(self.now_ns())
        self._running = ExitStack()
        self.launch = self._running.enter_context(
            launched_sensor(
                self.folder / f'launch_{len(self.launches_ns)}.log',
                'hardware:=real',
                f'lidar_port:={self.folder / "lidar"}',
                f'servo_port:={self.folder / "servo"}',
                f'assembler_params:={self._assembler_params}',
            )
        )

    def start_again(self) -> None:
        """Start the launch file again after it and its nodes ended, by force if necessary."""
        self.recorder.spin_until(lambda: not self.launch.running(), STOP_TIMEOUT)
        self.relaunch()

    def relaunch(self) -> None:
        """End the launch file and start it again."""
        self.nodes()
        self._running.close()
        if not self.recorder.spin_until(lambda: not self._left(), STOP_TIMEOUT):
            for process in self._left():
                process.kill()
        self.start()

    def _left(self) -> list[psutil.Process]:
        return [process for process in self._nodes.values() if process.is_running()]

    def nodes(self) -> dict[str, psutil.Process]:
        """Return the nodes' processes, those of the last running launch if it was killed."""
        self._nodes = node_processes(self.launch.process.pid) or self._nodes
        return self._nodes

    @staticmethod
    def now_ns() -> int:
        """Return the host time [ns]."""
        return time.time_ns()
