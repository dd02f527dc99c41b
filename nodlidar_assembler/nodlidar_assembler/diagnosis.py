"""What the assembler tells about itself on /diagnostics."""

from collections import Counter

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import DiagnosticStatusWrapper, Updater
from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.filters.scan_to_cloud import ScanToCloud
from nodlidar_common.nod import NS_PER_S
from rclpy.node import Node


class Diagnosis:
    """Counts what comes and goes, and reports it once a second with what was dropped.

    Parameters
    ----------
    node
        Whose diagnostics these are.
    scan_timeout
        Without a scan for so long something is wrong [s].
    to_cloud
        Knows what was dropped.
    """

    def __init__(self, node: Node, scan_timeout: float, to_cloud: ScanToCloud) -> None:
        self._clock = node.get_clock()
        self._scan_timeout = scan_timeout
        self._last_scan_ns = 0
        self.counts = Counter(scans=0, beams=0, clouds=0, points=0)
        self._to_cloud = to_cloud
        self._drops_told: Counter[str] = Counter()
        self._latency = 0.0
        self.updater = Updater(node)
        self.updater.setHardwareID('none')
        self.updater.add('clouds', self._report)

    def scan_arrived(self, now_ns: int, beams: int) -> None:
        """Count a scan."""
        self._last_scan_ns = now_ns
        self.counts.update(scans=1, beams=beams)

    def cloud_published(self, now_ns: int, cloud: Points) -> None:
        """Count a cloud, and note how long after its last point it was published."""
        self.counts.update(clouds=1, points=len(cloud.data))
        self._latency = (now_ns - int(cloud.time_ns[-1])) / NS_PER_S

    def _report(self, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        self._to_cloud.release()
        status.summary(*self._summary())
        for name, count in (self.counts | self._to_cloud.remarks).items():
            status.add(name, str(count))
        for reason, count in self._to_cloud.drops.items():
            status.add(f'dropped: {reason}', str(count))
        status.add('latency after the last point [s]', f'{self._latency:.4f}')
        return status

    def _summary(self) -> tuple[bytes, str]:
        new_drops = self._to_cloud.drops - self._drops_told
        self._drops_told = self._to_cloud.drops.copy()
        silence = (self._clock.now().nanoseconds - self._last_scan_ns) / NS_PER_S
        if not self.counts['scans']:
            return DiagnosticStatus.STALE, 'no scan has come yet'
        if silence > self._scan_timeout:
            return DiagnosticStatus.ERROR, f'no scan for {silence:.1f} s'
        if silence < -self._scan_timeout:
            return DiagnosticStatus.ERROR, 'no scan since the clock was set back'
        if new_drops:
            reason, count = new_drops.most_common(1)[0]
            return DiagnosticStatus.WARN, f'{count} dropped: {reason}'
        return DiagnosticStatus.OK, 'publishing clouds'
