"""Observed coverage of the last seconds, on ~/coverage and in the diagnostics."""

import math

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.control.coverage_monitor import CoverageMonitor
from nodlidar_assembler.control.observed_coverage import Covered
from nodlidar_assembler.ros.nod_publisher import NodPublisher
from nodlidar_common.ros.qos import OVERRIDABLE
from nodlidar_msgs.msg import Coverage
from rclpy.node import Node


class CoverageReport:
    """Publishes coverage with the diagnostics, once a second.

    Without new beams it is not published again: it is no longer that of the last seconds.

    Parameters
    ----------
    node, updater
        The assembler and its diagnostics.
    config
        Parameters of the assembler at start.
    nod
        Measures the duration of rounds, if the nod is commanded here.

    Attributes
    ----------
    monitor
        Takes the assembled scans.
    """

    def __init__(
        self,
        node: Node,
        updater: Updater,
        config: AssemblerConfig,
        nod: NodPublisher | None,
    ) -> None:
        self._clock = node.get_clock()
        self.monitor, self._nod = CoverageMonitor(config), nod
        self._until_ns: int | None = None
        self._message = Coverage(window=config.coverage_window)
        self._message.header.frame_id = config.frame_id
        self._message.cell = config.task.cell
        self._publisher = node.create_publisher(
            Coverage, '~/coverage', 10, qos_overriding_options=OVERRIDABLE
        )
        updater.add('coverage', self._report)

    def reconfigure(self, config: AssemblerConfig) -> None:
        """Report for the cells of another planned nod."""
        self.monitor.reconfigure(config)
        self._message.cell = config.task.cell

    def _report(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        covered = self.monitor.covered()
        if covered.until_ns == self._until_ns:
            status.summary(DiagnosticStatus.STALE, 'no beams since the last report')
        else:
            self._publish(covered)
            status.summary(DiagnosticStatus.OK, f'{covered.seen:.1%} of the cells seen')
        self._until_ns = covered.until_ns
        status.add('beams', str(covered.beams))
        status.add('share of cells seen', f'{covered.seen:.4f}')
        status.add('largest hole [rad]', f'{covered.hole:.4f}')
        status.add('share of repeats', f'{covered.repeats:.4f}')
        status.add('time to see all cells [s]', f'{self._message.time_to_see_all:.2f}')
        status.add('least share of repeats', f'{covered.least_repeats:.4f}')
        return status

    def _publish(self, covered: Covered) -> None:
        message = self._message
        message.header.stamp = self._clock.now().to_msg()
        fill_coverage(message, covered)
        nod = self._nod
        message.time_to_see_all = math.nan if nod is None else nod.controller.round_time
        self._publisher.publish(message)


def fill_coverage(message: Coverage, covered: Covered) -> None:
    """Fill in what was covered."""
    message.beams, message.cells, message.seen = covered.beams, covered.cells, covered.seen
    message.largest_hole = covered.hole
    message.repeats, message.least_repeats = covered.repeats, covered.least_repeats
