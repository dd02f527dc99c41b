"""The node's way from scans to clouds, fed from a bag instead of a ROS graph."""

from collections import Counter
from collections.abc import Callable

from message_filters import SimpleFilter
from nodlidar_assembler.bags.bag_source import Recorded
from nodlidar_assembler.bags.bag_tf import BagTf
from nodlidar_assembler.bags.bag_types import JOINT_STATE, SCAN, TF
from nodlidar_assembler.clouds.assembly import Points
from nodlidar_assembler.clouds.ego_motion import Odometry
from nodlidar_assembler.clouds.origins import frame_of
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.filters.scan_filter import ScanFilter
from nodlidar_assembler.filters.scan_to_cloud import ScanToCloud
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
        self._scans, self._states = SimpleFilter(), SimpleFilter()
        self._to_cloud = ScanToCloud(
            config,
            ScanFilter(self._scans, config, lambda reason: self._to_cloud.drop(reason)),
            self._states,
            tf,
            lambda: self._now_ns,
            self._made,
        )

    @property
    def drops(self) -> Counter[str]:
        """Scans and joint states that were dropped so far, counted by reason."""
        return self._to_cloud.drops

    @property
    def remarks(self) -> dict[str, int]:
        """How many scans were made otherwise than asked for, by what was done and the reason."""
        return self._to_cloud.remarks

    @property
    def aside(self) -> str:
        """Why joint samples or odometry never came, in parentheses; empty if they did."""
        return self._to_cloud.aside

    def add(self, recorded: Recorded) -> None:
        """Take a message of one of the types SCAN, JOINT_STATE and TF."""
        self._now_ns = max(self._now_ns, recorded.time_ns)
        if recorded.msgtype == SCAN:
            self.counts['scans'] += 1
            self._scans.signalMessage(recorded.message)
        elif recorded.msgtype == JOINT_STATE:
            self._states.signalMessage(recorded.message)
        elif recorded.msgtype == TF and self._tf is not None:
            self._tf.add(recorded.message)

    def finish(self) -> None:
        """Let the scans that still wait go, as when their deadlines are over."""
        for _ in range(2):  # that for joint samples, and that for odometry
            self._now_ns += round(self._config.deadline * NS_PER_S) + 1
            self._to_cloud.release()

    def _made(self, scan: Scan, clouds: list[Points], odometry: Odometry | None) -> None:
        for cloud in clouds:
            frame = self._config.frame_id
            if odometry is not None:
                frame = frame_of(cloud.origin, self._config.odom_frame)
            self.counts.update(clouds=1, points=len(cloud.data))
            self._publish(cloud, frame, self._now_ns)
