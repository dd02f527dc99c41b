"""The assembler node's filters and pipeline, fed from a bag instead of a ROS graph."""

from collections import Counter
from collections.abc import Callable

from message_filters import SimpleFilter
from nodlidar_assembler.assembly import Points
from nodlidar_assembler.bag import JOINT_STATE, SCAN
from nodlidar_assembler.bag_odometry import TF
from nodlidar_assembler.bag_source import Recorded
from nodlidar_assembler.bag_tf import BagTf
from nodlidar_assembler.bracket_filter import BracketFilter
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.ego_motion import Odometry, OdometryError
from nodlidar_assembler.joint_filter import JointFilter
from nodlidar_assembler.joint_history import JointSamples
from nodlidar_assembler.odometry_filter import OdometryFilter
from nodlidar_assembler.origins import frame_of
from nodlidar_assembler.pipeline import Pipeline
from nodlidar_assembler.pitch import PitchError
from nodlidar_assembler.scan_filter import ScanFilter
from nodlidar_assembler.scan_message import geometry_from_message, scan_from_message
from nodlidar_common.nod import NS_PER_S
from sensor_msgs.msg import LaserScan

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
        scans, clouds and points so far, and scans that were not compensated, by reason.
    drops
        Scans and joint states that were dropped, counted by reason.
    """

    def __init__(self, config: AssemblerConfig, publish: Publish, tf: BagTf | None = None) -> None:
        self.counts = Counter(scans=0, clouds=0, points=0)
        self.drops: Counter[str] = Counter()
        self._config, self._publish, self._tf = config, publish, tf
        self._pipeline = Pipeline.configured(config)
        self._now_ns, self._next_release_ns = 0, 0
        self._scans, self._states = SimpleFilter(), SimpleFilter()
        joint = JointFilter(self._states, config, self.drops)
        joint.registerCallback(self._pipeline.add_sample)
        bracket = BracketFilter(
            ScanFilter(self._scans, self._drop),
            joint,
            self._duration_ns,
            config.deadline,
            lambda: self._now_ns,
            lambda scan, reason: self._drop(reason),
            self._pipeline.estimator.margin_ns,
        )
        self._filters: list[BracketFilter | OdometryFilter] = [bracket]
        if tf is not None:
            self._filters.append(self._with_odometry(bracket, tf))
        self._filters[-1].registerCallback(self._assemble)

    def _with_odometry(self, bracket: BracketFilter, tf: BagTf) -> OdometryFilter:
        with_odometry = OdometryFilter(
            bracket,
            tf.history,
            self._duration_ns,
            self._config.deadline,
            lambda: self._now_ns,
            self._odometry_missing,
        )
        tf.register(with_odometry.forget)
        return with_odometry

    def add(self, recorded: Recorded, msgtype: str) -> None:
        """Take a message of one of the types SCAN, JOINT_STATE and TF."""
        self._now_ns = max(self._now_ns, recorded.time_ns)
        if msgtype == SCAN:
            self.counts['scans'] += 1
            self._scans.signalMessage(recorded.message)
        elif msgtype == JOINT_STATE:
            self._states.signalMessage(recorded.message)
        elif msgtype == TF and self._tf is not None:
            self._tf.add(recorded.message)
            self._filters[-1].release()
        if self._now_ns >= self._next_release_ns:
            self._release()

    def finish(self) -> None:
        """Let the scans that still wait go, as when their deadline is over."""
        for _ in self._filters:
            self._now_ns += round(self._config.deadline * NS_PER_S) + 1
            self._release()

    def _release(self) -> None:
        for each in self._filters:
            each.release()
        self._next_release_ns = self._now_ns + round(self._config.deadline / 2.0 * NS_PER_S)

    def _duration_ns(self, scan: LaserScan) -> int:
        return self._pipeline.beams(geometry_from_message(scan)).duration_ns

    def _assemble(
        self, scan: LaserScan, samples: JointSamples, odometry: Odometry | None = None
    ) -> None:
        try:
            clouds = self._pipeline.add_scan(scan_from_message(scan), *samples, odometry)
        except PitchError as error:
            self._drop(str(error))
            return
        except OdometryError as error:
            self._odometry_missing(scan, samples, error.reason)
            return
        for cloud in clouds:
            self.counts.update(clouds=1, points=len(cloud.data))
            self._publish(cloud, self._frame(cloud, odometry), self._now_ns)

    def _frame(self, cloud: Points, odometry: Odometry | None) -> str:
        if odometry is None:
            return self._config.frame_id
        return frame_of(cloud.origin, self._config.odom_frame)

    def _odometry_missing(self, scan: LaserScan, samples: JointSamples, reason: str) -> None:
        if self._config.without_odometry == 'drop':
            self._drop(reason)
        else:
            self.counts[f'uncompensated: {reason}'] += 1
            self._assemble(scan, samples)

    def _drop(self, reason: str) -> None:
        self.drops[reason] += 1

    @property
    def fallbacks(self) -> Counter[str]:
        """Return the scans that were told by slerp instead of trajectory, counted by reason."""
        return self._pipeline.estimator.fallbacks
