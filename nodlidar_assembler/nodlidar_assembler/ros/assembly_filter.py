"""The assembly in the manner of message_filters: scans in, what became of each out."""

from collections.abc import Callable, Sequence

from message_filters import SimpleFilter
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.joint_input import JointInput
from nodlidar_assembler.inputs.scan_input import RefusedScanError, ScanInput
from nodlidar_assembler.ros.host_clock import HostClock, SETTLING_NS
from nodlidar_assembler.scan_assembler import Outcome, ScanAssembler
from nodlidar_common.nod import NS_PER_S
from sensor_msgs.msg import JointState, LaserScan

CLOCK_WAS_SET = 'the clock was set'
UNSETTLED = f'within {SETTLING_NS / NS_PER_S} s after the clock was set'


class AssemblyFilter(SimpleFilter):
    """A message_filters filter: LaserScans and JointStates in, the Outcome of each scan out.

    Scans wait until what brackets them has come. Deadlines are looked at whenever something comes,
    not by a timer: waking up costs a node more than a cloud does.

    Parameters
    ----------
    scans, states
        Filters whose messages are LaserScans, and JointStates.
    config
        Parameters of the assembler.
    clock
        By which scans wait; knows when stamps are by another clock than before.
    warn
        Told in words of what is dropped or not compensated.
    odometry_trouble
        Tells why no odometry has come; nothing if it has.

    Attributes
    ----------
    scans, samples
        Filters: scans that were not refused, and joint samples [ns], [rad], as they arrive.
    joint, watch
        Know which joints are told of, and which revolutions came without a scan.
    assembler
        Knows what was dropped, or made otherwise than asked for.
    """

    def __init__(
        self,
        scans: SimpleFilter,
        states: SimpleFilter,
        config: AssemblerConfig,
        clock: HostClock,
        warn: Callable[[str], None],
        odometry_trouble: Callable[[], str],
    ) -> None:
        super().__init__()
        self._clock, self._warn, self._odometry_trouble = clock, warn, odometry_trouble
        self.assembler = ScanAssembler(config)
        self.scans, self.samples = SimpleFilter(), SimpleFilter()
        self._scan_input = ScanInput(config)
        self.watch = self._scan_input.watch
        self.joint = JointInput(config, self.assembler.drops)
        scans.registerCallback(self.add_scan)
        states.registerCallback(self.add_state)

    def add_scan(self, message: LaserScan) -> None:
        """Let a scan wait, unless it is refused."""
        if not self._clock.look():
            self.assembler.drops[f'scan {UNSETTLED}'] += 1
            return
        try:
            scan = self._scan_input.scan(message)
        except RefusedScanError as error:
            self.assembler.drops[str(error)] += 1
            self._warn(f'scan dropped: {error}')
            return
        self.scans.signalMessage(scan)
        self.assembler.add_scan(scan, self._clock.patience_ns())
        self.release()

    def add_state(self, message: JointState) -> None:
        """Add the joint samples of a joint state."""
        if not self._clock.look():
            self.assembler.drops[f'joint state {UNSETTLED}'] += 1
            return
        for sample in self.joint.samples(message):
            self.samples.signalMessage(*sample)
            self.assembler.add_joint_sample(*sample)
            self.release()

    def add_odometry(
        self, time_ns: int, position: Sequence[float], orientation: Sequence[float]
    ) -> None:
        """Add a pose of the frame of the clouds in that of odometry: [ns], [m], x y z w."""
        self.assembler.add_odometry(time_ns, position, orientation)
        self.release()

    def odometry_went_back(self) -> None:
        """Forget the odometry: that which comes is of another time."""
        self.assembler.odometry_went_back()
        self.release()

    def clock_was_set(self, step_ns: int) -> None:
        """Begin anew after the clock was set by a step [ns], dropping what waits."""
        self.watch.shift(step_ns)
        self.joint.restart()
        self.assembler.restart(CLOCK_WAS_SET)
        self.release()

    def release(self) -> None:
        """Pass on what became of scans by now; call it now and then where nothing may come."""
        for outcome in self.assembler.ready(self._clock.patience_ns()):
            self._tell(outcome)
            self.signalMessage(outcome)

    @property
    def trouble(self) -> str:
        """Why joint samples or odometry never came; empty if they did."""
        tf = self._odometry_trouble()
        return self.joint.trouble or (f'TF: {tf}' if tf else '')

    def _tell(self, outcome: Outcome) -> None:
        text = ''
        if outcome.dropped:
            text = f'scan dropped: {outcome.dropped}'
        elif outcome.uncompensated:
            text = f'motion not compensated: {outcome.uncompensated}'
        if text:
            self._warn(f'{text} ({self.trouble})' if self.trouble else text)
