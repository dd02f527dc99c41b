"""The assembly of the node, fed with the messages of a bag: what was late there is late here."""

from collections import Counter
from collections.abc import Callable
from contextlib import suppress

from nodlidar_assembler.bags.bag_source import Recorded
from nodlidar_assembler.bags.bag_tf import BagTf, Sample
from nodlidar_assembler.clouds.level_scan import LevelScan, LevelScanner
from nodlidar_assembler.clouds.origins import frame_of
from nodlidar_assembler.clouds.pipeline import Assembled
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.scan_input import RefusedScanError
from nodlidar_assembler.message_assembler import MessageAssembler
from nodlidar_common.bag_messages import JOINT_STATE, SCAN, TF
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.time_order import (
    TIME_JUMP_NS,
    TimeOrder,
    TRANSFORM_OUT_OF_ORDER,
)

# A cloud, the frame that it is in, and when the node would have published it [ns].
Publish = Callable[[Points, str, int], None]
# A level scan, its range_min [m], and when the node would have published it [ns].
PublishLevel = Callable[[LevelScan, float, int], None]


class BagReplay:
    """Assembles recorded messages into the same clouds as the node, with the same drops.

    Its clock is the time at which messages were recorded.

    Parameters
    ----------
    config
        Parameters of the assembler.
    publish
        Called with each cloud.
    tf
        The odometry; needed unless ego_motion is off.
    publish_level
        Called with each level scan; None without them.

    Attributes
    ----------
    counts
        scans, clouds and points so far, and level scans if there are any.
    assembler
        Counts drops and remarks.
    """

    def __init__(
        self,
        config: AssemblerConfig,
        publish: Publish,
        tf: BagTf | None = None,
        publish_level: PublishLevel | None = None,
    ) -> None:
        self.counts = Counter(scans=0, clouds=0, points=0)
        self._config, self._publish, self._tf = config, publish, tf
        self._publish_level = publish_level
        self._level_scanner = None if publish_level is None else LevelScanner(config)
        self._now_ns, self._in_odometry = 0, False
        if tf is None:
            self.assembler = MessageAssembler(config, lambda: '')
        else:
            self.assembler = MessageAssembler(config, lambda: tf.missing_input, tf.mount)
        self._odometry_order: TimeOrder[Sample] = TimeOrder(
            lambda: self.assembler.drops.update([TRANSFORM_OUT_OF_ORDER]),
            longest_fall_ns=TIME_JUMP_NS,
        )

    def add(self, recorded: Recorded) -> None:
        """Add a message of one of the types SCAN, JOINT_STATE and TF."""
        message = recorded.message
        self._now_ns = max(self._now_ns, recorded.time_ns)
        if recorded.msgtype == SCAN:
            self.counts['scans'] += 1
            with suppress(RefusedScanError):
                scan = self.assembler.scan(message, recorded.time_ns)
                self.assembler.add_scan(scan, self._now_ns)
            self._publish_ready()
        elif recorded.msgtype == JOINT_STATE:
            for _ in self.assembler.add_joint_state(message):
                self._publish_ready()
        elif recorded.msgtype == TF and self._tf is not None:
            for sample in self._tf.samples(message, self.assembler.drops):
                for pose in self._odometry_order.add(sample[0], sample, self._now_ns):
                    self.assembler.add_odometry(*pose)
                    self._publish_ready()

    def finish(self) -> None:
        """Publish what is left: scans that wait, as at their deadlines, and the last sweep."""
        while self.assembler.is_waiting:  # for joint samples, then for odometry
            self._now_ns += round(self._config.deadline * NS_PER_S) + 1
            self._publish_ready()
        self._publish_clouds(self.assembler.flush())

    def _publish_ready(self) -> None:
        for outcome in self.assembler.ready(self._now_ns):
            if (assembled := outcome.assembled) is None:
                continue
            self._publish_level_scans(assembled)
            self._in_odometry = assembled.in_odometry
            self._publish_clouds(assembled.clouds)

    def _publish_clouds(self, clouds: list[Points]) -> None:
        for cloud in clouds:
            frame = self._config.frame_id
            if self._in_odometry:
                frame = frame_of(cloud.origin, self._config.odom_frame)
            self.counts.update(clouds=1, points=len(cloud.data))
            self._publish(cloud, frame, self._now_ns)

    def _publish_level_scans(self, assembled: Assembled) -> None:
        if self._level_scanner is None or self._publish_level is None:
            return
        for scan in self._level_scanner.add(assembled):
            self.counts['level scans'] += 1
            self._publish_level(scan, assembled.scan.geometry.range_min, self._now_ns)
