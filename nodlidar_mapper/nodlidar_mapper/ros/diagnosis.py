"""The mapper's state on /diagnostics."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper
from nodlidar_common.recent import Recent
from nodlidar_common.ros.diagnostics import SteadyUpdater
from nodlidar_common.ros.steady import steady_ns
from nodlidar_mapper.graph.map_snapshot import MapSnapshot

if TYPE_CHECKING:
    from nodlidar_mapper.ros.node import MapperNode

RECENT = 5.0  # s, for which a drop is reported
UNUSED = 3.0  # s, in which all clouds were dropped
UNCERTAIN = 1.0  # standard deviation of the place in the map, from which on it is a warning [m]


class Diagnosis:
    """Reports where the mapper is, or why it is not; changes at once.

    Parameters
    ----------
    node
        The mapper.
    """

    def __init__(self, node: MapperNode) -> None:
        self._node = node
        self._took = 0.0
        self._seen: Counter[str] = Counter()
        self._recent = Recent(RECENT)
        self._recent.add(steady_ns(), self._seen)
        self.updater = SteadyUpdater(node, node.config.base_frame, self._state)
        self.updater.add('map', self._report)

    def matched(self, took: float) -> None:
        """Note the time that a cloud took [s]."""
        self._took = took

    def _state(self) -> object:
        self._note_drops()
        silent = list(self._silent()), self._unheard()
        dropped = bool(self._recent.counts), self._node.clouds.unused > UNUSED
        in_map = self._lost(), bool(doubt_of(self._node.output.snapshot))
        return silent, in_map, dropped, self._shared(), self._node.output.kept.unsaved

    def _silent(self) -> dict[str, float]:
        """Return since when there is no cloud [s], for each topic that is silent."""
        now_ns, silences = steady_ns(), self._node.clouds.silences
        seconds = {topic: silence.seconds(now_ns) for topic, silence in silences.items()}
        return {topic: silent for topic, silent in seconds.items() if silent}

    def _unheard(self) -> list[str]:
        """Return the topics without a cloud so far, if there are clouds of another one."""
        silences = self._node.clouds.silences
        unheard = [topic for topic, silence in silences.items() if not silence.ever_heard]
        return unheard if len(unheard) < len(silences) else []

    def _lost(self) -> bool:
        snapshot = self._node.output.snapshot
        return snapshot is not None and bool(snapshot.estimate.lost)

    def _shared(self) -> list[str]:
        """Return what has more than one publisher: clouds of another are a wrong place."""
        topics, odometry = self._node.clouds.silences, self._node.clouds.odometry
        counts = {topic: self._node.count_publishers(topic) for topic in topics}
        counts |= odometry.shared
        return [
            f'{count} publishers of {what}: stop all but one'
            for what, count in counts.items()
            if count > 1
        ]

    def _note_drops(self) -> None:
        errors = {f'internal error: {k}': n for k, n in self._node.survival.errors.items()}
        self._seen = Counter(self._node.clouds.drops) + Counter(errors)
        self._recent.add(steady_ns(), self._seen)

    def _report(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        node, snapshot = self._node, self._node.output.snapshot
        self._note_drops()
        self._summarise(status, snapshot)
        status.add('clouds', str(node.clouds.received))
        for name, count in self._seen.items():
            status.add(name, str(count))
        if snapshot is not None:
            estimate = snapshot.estimate
            deviation = estimate.covariance.diagonal() ** 0.5
            values = {
                'keyframes': len(snapshot.keyframes),
                'loops closed': snapshot.loops,
                'points near the map that lie on it [%]': f'{100.0 * estimate.share:.0f}',
                'their distance from it, RMS [mm]': f'{1000.0 * estimate.residual:.1f}'
                if estimate.share
                else 'no point is near the map',
                'standard deviation of x and y [m]': f'{deviation[0]:.4f} {deviation[1]:.4f}',
                'standard deviation of yaw [rad]': f'{deviation[5]:.5f}',
                'time per cloud [ms]': f'{1000.0 * self._took:.0f}',
            }
            for name, value in values.items():
                status.add(name, str(value))
        return status

    def _summarise(self, status: DiagnosticStatusWrapper, snapshot: MapSnapshot | None) -> None:
        node = self._node
        status.summary(DiagnosticStatus.OK, 'the robot is found in the map')
        if snapshot is None:
            status.summary(DiagnosticStatus.WARN, 'no cloud matched yet')
            if node.clouds.received and node.clouds.odometry.missing_input:
                text = f'no odometry: {node.clouds.odometry.missing_input}'
                status.mergeSummary(DiagnosticStatus.ERROR, text)
        elif snapshot.estimate.lost:
            text = f'lost: {snapshot.estimate.lost}'
            status.summary(DiagnosticStatus.ERROR, text)
        elif doubt := doubt_of(snapshot):
            status.summary(DiagnosticStatus.WARN, doubt)
        if unsaved := node.output.kept.unsaved:
            status.mergeSummary(DiagnosticStatus.ERROR, unsaved)
        for topic, silent in self._silent().items():
            status.mergeSummary(DiagnosticStatus.ERROR, f'no cloud on {topic} for {silent:.1f} s')
        if node.clouds.unused > UNUSED:
            text = f'no cloud was used for {node.clouds.unused:.0f} s'
            status.mergeSummary(DiagnosticStatus.ERROR, text)
        for topic in self._unheard():
            status.mergeSummary(DiagnosticStatus.WARN, f'no cloud on {topic} yet')
        for text in self._shared():
            status.mergeSummary(DiagnosticStatus.WARN, text)
        for what, count in self._recent.counts.most_common(1):
            status.mergeSummary(DiagnosticStatus.WARN, f'{count} {what}')


def doubt_of(snapshot: MapSnapshot | None) -> str:
    """Return how uncertain it is where the robot is in the map; empty if it is usual."""
    if snapshot is None or snapshot.estimate.uncertainty <= UNCERTAIN:
        return ''
    return (
        f'the place in the map is uncertain by {snapshot.estimate.uncertainty:.1f} m (standard '
        'deviation), as after a pause of odometry, until it is back in an older part'
    )
