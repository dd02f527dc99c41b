"""Publishes the nod command, for as long as scans come."""

import math

from nodlidar_assembler.clouds.geometry import Beams, ScanGeometry
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.control.nod_clock import NodShape
from nodlidar_assembler.control.nod_controller import NodConfig, NodController
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import NS_PER_S
from nodlidar_common.ros.messages import nod_to_message
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from nodlidar_common.survival import Survival
from nodlidar_msgs.msg import NodCommand
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions


class NodCommander:
    """The nod controller with its topic.

    Parameters
    ----------
    node, config
        The assembler, and its parameters as it was started.
    frame_id
        Frame in which the nod is commanded.
    survival
        The shell around what is done periodically.
    """

    def __init__(self, node: Node, config: NodConfig, frame_id: str, survival: Survival) -> None:
        self._node, self._config, self._frame_id = node, config, frame_id
        self._configured = NodShape(config.pitch_min, config.pitch_max, config.samples_per_sweep)
        self._controller = NodController(config)
        self._last_scan_ns = 0  # by the steady clock, as the timer: a clock may be set
        self._warn_if_samples_repeat()
        self._commands = node.create_publisher(
            NodCommand,
            'nod_command',
            QoSProfile(depth=1),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        create_steady_timer(node, 1.0 / config.command_rate, survival.guarded(self._publish))

    @property
    def round_time(self) -> float:
        """How long it took to see all cells the last time [s]; NaN if that is not known."""
        return self._controller.round_time

    def follow_lidar(self, scan: Scan) -> None:
        """Keep the nod tied to the lidar's revolutions; its first command goes out at once."""
        first = self._controller.command is None
        self._last_scan_ns = steady_ns()
        try:
            self._controller.add_scan(scan.geometry, scan.stamp_ns)
        except ParameterError as error:
            self._error(f'no nod commanded: {error}')
        else:
            if first:
                self._warn_of_other_steps(scan.geometry)
                self._publish()

    def clock_was_set(self, step_ns: int) -> None:
        """Go on with the nod by a clock that was set by a step [ns]; the servo is told at once."""
        self._controller.shift(step_ns)
        self._publish()

    def adapt(
        self, shape: NodShape | None, scan: Scan, beams: Beams, pitch: NDArray[np.float64]
    ) -> None:
        """Command the nod that goes with the monitor, if it is another.

        Parameters
        ----------
        shape
            Limits and N_s to take; what is configured if there are none.
        scan, beams, pitch
            A scan, its beams and their pitch [rad], which tell what was seen.
        """
        now_ns = self._now_ns()
        changed = self._controller.change(shape or self._configured, now_ns)
        try:
            chosen = self._controller.saw(scan, beams, pitch, now_ns)
        except ParameterError as error:
            self._error(f'no sweep chosen: {error}')
            chosen = False
        if changed or chosen:
            self._publish()

    def _publish(self) -> None:
        """Publish the command while scans come: without them the servo shall let go."""
        command = self._controller.command
        silent = steady_ns() - self._last_scan_ns > self._config.scan_timeout * NS_PER_S
        if command is not None and not silent:
            nod, start_ns = command
            message = nod_to_message(nod, self._now_ns(), self._frame_id, start_ns)
            self._commands.publish(message)

    def _warn_if_samples_repeat(self) -> None:
        n_s, n_l = self._config.samples_per_sweep, self._config.steps_per_revolution
        if math.gcd(n_s, n_l) > 1:
            self._node.get_logger().warning(
                f'samples_per_sweep = {n_s} and steps_per_revolution = {n_l} share the divisor '
                f'{math.gcd(n_s, n_l)}: samples repeat'
            )

    def _warn_of_other_steps(self, geometry: ScanGeometry) -> None:
        """Warn if N_L is not that of a lidar, which may thin its beams: N_s would be another."""
        steps, told = self._config.steps_per_revolution, math.tau / abs(geometry.angle_increment)
        thinned = max(round(steps / told), 1)
        if abs(steps / (thinned * told) - 1.0) > 0.01:
            self._node.get_logger().warning(
                f'steps_per_revolution = {steps}, but angle_increment of the scan tells {told:.0f}'
                ': the nod is not coprime with this lidar'
            )

    def _error(self, text: str) -> None:
        self._node.get_logger().error(text, throttle_duration_sec=5.0)

    def _now_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)
