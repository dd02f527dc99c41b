"""Publishes the nod command while scans arrive."""

from __future__ import annotations

from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.pipeline import Assembled, Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.nod_controller import NodController
from nodlidar_assembler.control.nod_shape import NodShape
from nodlidar_assembler.inputs.scan_clock import ScanClock
from nodlidar_assembler.ros.clock_watch import ClockWatch
from nodlidar_common.errors import ParameterError
from nodlidar_common.nod import Nod
from nodlidar_common.ros.messages import nod_to_message
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_common.ros.steady import create_steady_timer, steady_ns
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.survival import Survival
from nodlidar_msgs.msg import NodCommand
from nodlidar_planner.pattern.pattern import Pattern
from rclpy.node import Node

# In intervals of command_rate: from when on a scan takes a command along, which wakes nobody up,
# and when a timer publishes one without a scan.
_SOON, _LATE = 0.9, 1.5


class NodPublisher:
    """The topic of the nod that NodController selects.

    Parameters
    ----------
    node, config
        The assembler, and its parameters at start.
    clock
        The host's clocks.
    survival
        Catches errors of the timer.
    before
        That of a node which this one replaces: its nod goes on, with the parameters of this one.

    Attributes
    ----------
    controller
        What is commanded.
    """

    def __init__(
        self,
        node: Node,
        config: AssemblerConfig,
        clock: ClockWatch,
        survival: Survival,
        before: NodPublisher | None = None,
    ) -> None:
        self._node, self._config, self._clock = node, config, clock
        self.controller = NodController(config)
        self._last_scan_ns = 0  # steady clock, like the timer
        self._scan_clock = ScanClock()
        self._commands = node.create_publisher(
            NodCommand, 'nod_command', 1, qos_overriding_options=OVERRIDABLE
        )
        self._interval_ns = NS_PER_S / config.command_rate
        self._published_ns = 0
        self._timer = create_steady_timer(
            node, _LATE / config.command_rate, survival.guarded(self._publish)
        )
        if before is None:
            self._warn_if_samples_repeat()
        else:
            self.controller, self._scan_clock = before.controller, before._scan_clock
            self._last_scan_ns = before._last_scan_ns
            self.controller.give_back(self.now_ns())
            self.reconfigure(config)
            if self.controller.command is not None:
                self._warn_of_other_steps()

    def follow_lidar(self, scan: Scan) -> None:
        """Keep the nod phase-locked to the lidar; publish the first command at once."""
        first = self.controller.command is None
        self._last_scan_ns = steady_ns()
        since_ns = self._last_scan_ns - self._published_ns
        due = first or self.controller.approaching or since_ns >= _SOON * self._interval_ns
        self._scan_clock.add(scan.end_ns, self._clock.deadline_clock_ns())
        try:
            self.controller.add_scan(scan.geometry, scan.stamp_ns)
        except ParameterError as error:
            self._error(f'no nod commanded: {error}')
        else:
            if first:
                self._warn_of_other_steps()
            if due:
                self._publish()

    def reconfigure(self, config: AssemblerConfig) -> None:
        """Continue with another planned nod; publish it at once."""
        self._config = config
        self._warn_if_samples_repeat()
        self.controller.reconfigure(config, self.now_ns())
        self._publish()

    def clock_was_set(self, step_ns: int) -> None:
        """Continue the nod after the clock was set by a step [ns]; publish it at once."""
        self.controller.shift(step_ns)
        self._scan_clock.shift(step_ns)
        self._publish()

    def take_over(self, shape: NodShape) -> int:
        """Nod with a shape; return from when on [ns]. See NodController."""
        begin_ns = self.controller.take_over(shape, self.now_ns())
        self._publish()
        return begin_ns

    def give_back(self) -> None:
        """Return to the planned nod, and from the next scan on to adapted limits."""
        self.controller.give_back(self.now_ns())
        self._publish()

    @property
    def commanded(self) -> Nod | None:
        """The nod that is commanded at present; None if there is none."""
        command = None if self.silent else self.controller.command
        return None if command is None else command[0]

    @property
    def silent(self) -> bool:
        """Whether no scan has come for scan_timeout."""
        return steady_ns() - self._last_scan_ns > self._config.scan_timeout * NS_PER_S

    def adapt(self, assembled: Assembled, odometry: Odometry | None) -> None:
        """Choose the nod by the range and the coverage that a scan shows."""
        now_ns = self.now_ns()
        changed = self.controller.follow_range(assembled, odometry, now_ns)
        try:
            chosen = self.controller.add_beams(
                assembled.scan.stamp_ns, assembled.beams, assembled.pitch, now_ns
            )
        except ParameterError as error:
            self._error(f'no sweep chosen: {error}')
            chosen = False
        if changed or chosen:
            self._publish()

    def _publish(self) -> None:
        """Publish the command while scans arrive: without them the servo must let go."""
        command = self.controller.command
        if command is not None and not self.silent:
            nod, start_ns = self._config.joint_axis.positions(command[0]), command[1]
            message = nod_to_message(nod, self.now_ns(), self._config.frame_id, start_ns)
            self._commands.publish(message)
            self._published_ns = steady_ns()
            self._timer.reset()

    def _warn_if_samples_repeat(self) -> None:
        n_s, n_l = self._config.samples_per_sweep, self._config.steps_per_revolution
        if (repeats := Pattern(n_l, n_s).repeats) > 1:
            self._node.get_logger().warning(
                f'samples_per_sweep = {n_s} and steps_per_revolution = {n_l} have a common '
                f'divisor, so samples repeat {repeats} times sooner: choose a coprime '
                'samples_per_sweep'
            )

    def _warn_of_other_steps(self) -> None:
        """Warn if the lidar has another N_L than configured."""
        steps, found = self._config.steps_per_revolution, self.controller.view.config
        if found.steps_per_revolution != steps:
            self._node.get_logger().warning(
                f'steps_per_revolution = {steps}, but angle_increment of the scan implies '
                f'{found.steps_per_revolution}: samples_per_sweep = {found.samples_per_sweep} '
                f'instead of {self._config.samples_per_sweep}'
            )

    def _error(self, text: str) -> None:
        self._node.get_logger().error(text, throttle_duration_sec=5.0)

    def now_ns(self) -> int:
        """Return the present time by the clock of the stamps [ns]."""
        host = self._clock
        if host.is_simulated and host.now_ns():  # by then all stamps are of /clock
            return host.now_ns()
        return self._scan_clock.now_ns(host.deadline_clock_ns(), host.now_ns())
