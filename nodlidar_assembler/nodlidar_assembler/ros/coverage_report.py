"""What the last seconds of beams have covered, on ~/coverage and in the diagnostics."""

from collections.abc import Callable
import math

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
from nodlidar_assembler.control.runtime_coverage import Covered
from nodlidar_assembler.control.scene_monitor import SceneMonitorConfig
from nodlidar_assembler.ros.nod_commander import NodCommander
from nodlidar_msgs.msg import Coverage
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions


class CoverageReport:
    """Publishes coverage whenever the diagnostics are told, once a second, and tells it there.

    Without new beams it is not published again: it is not of the last seconds any more.

    Parameters
    ----------
    node, updater
        Of which this is told, and its diagnostics.
    config, frame_id
        What is looked for, and over what time; in which frame.
    covered
        Gives what has been covered.
    nod
        Knows how long it took to see all cells, if the nod is commanded here.
    """

    def __init__(
        self,
        node: Node,
        updater: Updater,
        config: SceneMonitorConfig,
        frame_id: str,
        covered: Callable[[], Covered],
        nod: NodCommander | None,
    ) -> None:
        self._clock = node.get_clock()
        self._covered, self._nod = covered, nod
        self._until_ns: int | None = None
        self._told = Coverage(
            window=config.coverage_window, cell=config.task.cell, cells=config.task.cells
        )
        self._told.header.frame_id = frame_id
        self._publisher = node.create_publisher(
            Coverage,
            '~/coverage',
            QoSProfile(depth=10),
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        updater.add('coverage', self._report)

    def _report(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        covered = self._covered()
        if covered.until_ns == self._until_ns:
            status.summary(DiagnosticStatus.STALE, 'no beams have come since it was told')
        else:
            self._publish(covered)
            status.summary(DiagnosticStatus.OK, f'{covered.seen:.1%} of the cells seen')
        self._until_ns = covered.until_ns
        status.add('beams', str(covered.beams))
        status.add('share of cells seen', f'{covered.seen:.4f}')
        status.add('largest hole [rad]', f'{covered.hole:.4f}')
        status.add('share of repeats', f'{covered.repeats:.4f}')
        status.add('time to see all cells [s]', f'{self._told.time_to_see_all:.2f}')
        status.add('least share of repeats', f'{covered.least_repeats:.4f}')
        return status

    def _publish(self, covered: Covered) -> None:
        told = self._told
        told.header.stamp = self._clock.now().to_msg()
        told.beams, told.seen, told.largest_hole = covered.beams, covered.seen, covered.hole
        told.repeats, told.least_repeats = covered.repeats, covered.least_repeats
        told.time_to_see_all = math.nan if self._nod is None else self._nod.round_time
        self._publisher.publish(told)
