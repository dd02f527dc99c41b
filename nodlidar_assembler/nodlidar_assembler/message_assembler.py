"""The assembly as the node and bags run it: messages in, one outcome per scan out."""

from collections.abc import Callable, Iterator
from typing import Any

from nodlidar_assembler.clouds.geometry import revolution_time
from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_assembler.plausibility.scan_angles import angles_in_doubt
from nodlidar_assembler.plausibility.scan_jitter import ScanJitter
from nodlidar_assembler.plausibility.scan_rate import ScanRate
from nodlidar_assembler.scan_assembler import ScanAssembler
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S

CLOCK_WAS_SET = 'the clock was set'
_OTHER_CLOCK = 60.0  # s between stamps of what comes together: clocks are not synchronised


class MessageAssembler(ScanAssembler):
    """A ScanAssembler that takes messages, from rclpy or a bag, and counts those it refuses.

    Parameters
    ----------
    config
        Parameters of the assembler.
    missing_odometry
        Returns why there is no odometry; empty if there is some.
    mount
        See ScanAssembler.

    Attributes
    ----------
    joint
        Selects the samples of the nod joint.
    timing
        Counts the revolutions of the lidar without a scan.
    """

    def __init__(
        self,
        config: AssemblerConfig,
        missing_odometry: Callable[[], str],
        mount: Pose | None = None,
    ) -> None:
        super().__init__(config, mount)
        self._missing_odometry = missing_odometry
        self._scan_input = ScanInput(config)
        self._scan_angles, self._scan_rate, self._scan_jitter = '', ScanRate(), ScanJitter()
        self._pitch = 0.0  # the latest [rad]
        self._joint_came = False  # since the last scan
        # By how much stamps of joint states are ahead of that of the scan that came with them [s].
        self._ahead = 0.0
        self.timing = self._scan_input.timing
        self.joint = JointInput(config, self.drops)

    @property
    def missing_input(self) -> str:
        """Why there are no joint samples or no odometry; empty if there are both."""
        tf = self._missing_odometry()
        return self.joint.missing_input or self._other_clock or (f'TF: {tf}' if tf else '')

    @property
    def _other_clock(self) -> str:
        """By how much the clocks of scans and joint states differ; empty if they agree."""
        if abs(self._ahead) < _OTHER_CLOCK:
            return ''
        order = (
            f'{abs(self._ahead):.0f} s {"before" if self._ahead > 0.0 else "after"} joint states'
        )
        return f'scans are stamped {order}: synchronise the clocks, or set scan_clock to device'

    @property
    def doubts(self) -> list[str]:
        """What is wrong with valid scans and joint states, by themselves; empty texts if not."""
        return [
            self._scan_angles,
            self._scan_rate.warning,
            self._scan_jitter.warning,
            self.joint.scatter.warning,
        ]

    def scan(self, message: Any, arrived_ns: int) -> Scan:
        """Return a LaserScan that arrived at an instant [ns] as a scan to add.

        A malformed or mistimed one is counted, and RefusedScanError raised.
        """
        try:
            scan = self._scan_input.scan(message, arrived_ns)
        except RefusedScanError as error:
            self.drops[error.reason] += 1
            raise
        self._scan_angles = angles_in_doubt(message)
        nominal = revolution_time(scan.geometry)
        self._scan_rate.add(scan.stamp_ns, nominal)
        self._scan_jitter.add(scan.stamp_ns, nominal, self._pitch)
        if self._joint_came and self.newest_joint_ns is not None:
            self._ahead = (self.newest_joint_ns - scan.stamp_ns) / NS_PER_S
        self._joint_came = False
        return scan

    def add_joint_state(self, message: Any) -> Iterator[tuple[int, float]]:
        """Add the samples of a JointState one by one; yield each [ns], [rad] once it is added.

        Take the outcomes that are ready after each, since time may go back with the next.
        """
        for sample in self.joint.samples(message):
            if sample[0] < (self.newest_joint_ns or 0):
                self.timing.joints_went_back()
            self.add_joint_sample(*sample)
            self._joint_came, self._pitch = True, sample[1]
            yield sample

    def clock_was_set(self, step_ns: int) -> None:
        """Restart after the clock was set by a step [ns]; waiting scans are dropped."""
        self._scan_input.shift(step_ns)
        self.joint.restart()
        self.restart(CLOCK_WAS_SET)
