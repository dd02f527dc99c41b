"""The assembly as the node and bags run it: messages in, one outcome per scan out."""

from collections.abc import Callable, Iterator
from typing import Any

from nodlidar_assembler.clouds.pipeline import Scan
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_assembler.scan_assembler import ScanAssembler
from nodlidar_common.pose import Pose

CLOCK_WAS_SET = 'the clock was set'


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
    watch
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
        self.watch = self._scan_input.watch
        self.joint = JointInput(config, self.drops)

    @property
    def missing_input(self) -> str:
        """Why there are no joint samples or no odometry; empty if there are both."""
        tf = self._missing_odometry()
        return self.joint.missing_input or (f'TF: {tf}' if tf else '')

    def scan(self, message: Any) -> Scan:
        """Return a LaserScan as a scan to add, or count and raise RefusedScanError."""
        try:
            return self._scan_input.scan(message)
        except RefusedScanError as error:
            self.drops[str(error)] += 1
            raise

    def add_joint_state(self, message: Any) -> Iterator[tuple[int, float]]:
        """Add the samples of a JointState one by one; yield each [ns], [rad] once it is added.

        Take the outcomes that are ready after each, since time may go back with the next.
        """
        for sample in self.joint.samples(message):
            self.add_joint_sample(*sample)
            yield sample

    def clock_was_set(self, step_ns: int) -> None:
        """Restart after the clock was set by a step [ns]; waiting scans are dropped."""
        self.watch.shift(step_ns)
        self.joint.restart()
        self.restart(CLOCK_WAS_SET)
