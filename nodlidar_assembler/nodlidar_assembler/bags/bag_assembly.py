"""The node's way from scans to clouds, fed from a bag instead of a ROS graph."""

from collections import Counter
from collections.abc import Callable
from typing import Any

from nodlidar_assembler.bags.bag_source import Recorded
from nodlidar_assembler.bags.bag_tf import BagTf
from nodlidar_assembler.bags.bag_types import JOINT_STATE, SCAN, TF
from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.origins import frame_of
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_assembler.scan_assembler import ScanAssembler
from nodlidar_common.nod import NS_PER_S

# A cloud, the frame that it is in, and when the node would have published it [ns].
Publish = Callable[[Points, str, int], None]


class BagAssembly:
    """Makes of recorded messages the clouds that the node makes of the same ones, and its drops.

    Its clock is the time at which messages were recorded.

    Parameters
    ----------
    config
        Parameters of the assembler.
    publish
        Called with each cloud.
    tf
        The odometry; needed unless ego_motion is off.

    Attributes
    ----------
    counts
        scans, clouds and points so far.
    """

    def __init__(self, config: AssemblerConfig, publish: Publish, tf: BagTf | None = None) -> None:
        self.counts = Counter(scans=0, clouds=0, points=0)
        self._config, self._publish, self._tf = config, publish, tf
        self._now_ns = 0
        self._assembler = ScanAssembler(config, None if tf is None else tf.mount)
        self._scans = ScanInput(config)
        self._joint = JointInput(config, self._assembler.drops)

    @property
    def drops(self) -> Counter[str]:
        """Scans and joint states that were dropped so far, counted by reason."""
        return self._assembler.drops

    @property
    def remarks(self) -> dict[str, int]:
        """How many scans were made otherwise than asked for, by what was done and the reason."""
        return self._assembler.remarks

    @property
    def trouble(self) -> str:
        """Why joint samples or odometry never came; empty if they did."""
        tf = self._tf.trouble if self._tf is not None else ''
        return self._joint.trouble or (f'TF: {tf}' if tf else '')

    def add(self, recorded: Recorded) -> None:
        """Take a message of one of the types SCAN, JOINT_STATE and TF."""
        self._now_ns = max(self._now_ns, recorded.time_ns)
        if recorded.msgtype == SCAN:
            self._add_scan(recorded.message)
        elif recorded.msgtype == JOINT_STATE:
            for sample in self._joint.samples(recorded.message):
                self._assembler.add_joint_sample(*sample)
                self._publish_ready()
        elif recorded.msgtype == TF and self._tf is not None:
            for pose in self._tf.samples(recorded.message):
                self._assembler.add_odometry(*pose)
                self._publish_ready()

    def finish(self) -> None:
        """Let the scans that still wait go, as when their deadlines are over."""
        for _ in range(2):  # that for joint samples, and that for odometry
            self._now_ns += round(self._config.deadline * NS_PER_S) + 1
            self._publish_ready()

    def _add_scan(self, message: Any) -> None:
        self.counts['scans'] += 1
        try:
            self._assembler.add_scan(self._scans.scan(message), self._now_ns)
        except RefusedScanError as error:
            self.drops[str(error)] += 1
        self._publish_ready()

    def _publish_ready(self) -> None:
        for outcome in self._assembler.ready(self._now_ns):
            if outcome.assembled is not None:
                self._publish_clouds(outcome.assembled)

    def _publish_clouds(self, assembled: Assembled) -> None:
        for cloud in assembled.clouds:
            frame = self._config.frame_id
            if assembled.odometry is not None:
                frame = frame_of(cloud.origin, self._config.odom_frame)
            self.counts.update(clouds=1, points=len(cloud.data))
            self._publish(cloud, frame, self._now_ns)
