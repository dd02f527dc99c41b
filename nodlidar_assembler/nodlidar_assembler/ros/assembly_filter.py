"""The assembly as a filter of message_filters: messages in, the outcome of each scan out."""

from collections.abc import Callable, Sequence

from message_filters import SimpleFilter
from nodlidar_assembler.config import AssemblerConfig
from nodlidar_assembler.inputs.scan_input import RefusedScanError
from nodlidar_assembler.message_assembler import MessageAssembler
from nodlidar_assembler.ros.clock_watch import ClockWatch, SETTLING_NS
from nodlidar_assembler.ros.input import Input, PolledInput
from nodlidar_assembler.scan_assembler import Outcome
from nodlidar_common.ros.steady import steady_ns
from nodlidar_common.stamps import NS_PER_S, time_ns
from sensor_msgs.msg import JointState, LaserScan

UNSETTLED = f'within {SETTLING_NS / NS_PER_S} s after the clock was set'
SEVERAL = 'joint state while several publishers send the joint'


class AssemblyFilter(SimpleFilter):
    """A message_filters filter: LaserScans and JointStates in, the Outcome of each scan out.

    Scans wait until joint samples, and odometry if used, bracket them. Joint states are taken when
    a scan has arrived, and wake the node only while one waits: waking up costs a node more than a
    cloud does. For the same reason deadlines are checked when a message arrives, not by a timer.

    Parameters
    ----------
    scans, states
        LaserScans, and JointStates to be taken.
    config
        Parameters of the assembler.
    clock
        Clock of the deadlines; detects steps of the clock of the stamps.
    warn
        Called with a text for each scan that is dropped or not compensated.
    missing_odometry
        Returns why there is no odometry; empty if there is some.

    Attributes
    ----------
    scans, samples, odometry
        Filters: scans that were not refused, joint samples [ns], [rad], and odometry as it is
        added, all as they arrive.
    assembler
        Counts drops and remarks.
    refused_ns
        When a scan was refused last, by a steady clock [ns]; 0 if none was.
    """

    def __init__(
        self,
        scans: Input,
        states: PolledInput,
        config: AssemblerConfig,
        clock: ClockWatch,
        warn: Callable[[str], None],
        missing_odometry: Callable[[], str],
    ) -> None:
        super().__init__()
        self._clock, self._scans, self._states, self._warn = clock, scans, states, warn
        self.assembler = MessageAssembler(config, missing_odometry)
        self.refused_ns = 0
        self.scans, self.samples, self.odometry = (SimpleFilter() for _ in range(3))
        scans.registerCallback(self.add_scan)
        states.registerCallback(self.add_state)

    def add_scan(self, message: LaserScan) -> None:
        """Add a scan, unless it is refused."""
        if not self._clock.check(type(message), time_ns(message.header.stamp)):
            self.assembler.drops[f'scan {UNSETTLED}'] += 1
            return
        try:
            arrived_ns = self._clock.arrival_ns(self._scans.arrived_ns)
            scan = self.assembler.scan(message, arrived_ns)
        except RefusedScanError as error:
            self.refused_ns = steady_ns()
            self._warn(f'scan dropped: {error}')
            return
        self.scans.signalMessage(scan)
        self._states.take()  # before the scan, as they came: time may have gone back with them
        self.assembler.add_scan(scan, self._clock.deadline_clock_ns())
        self.release()

    def add_state(self, message: JointState) -> None:
        """Add the joint samples of a joint state."""
        stamp_ns = time_ns(message.header.stamp)
        if not self._clock.check(type(message), stamp_ns, self._states.arrived_ns):
            self.assembler.drops[f'joint state {UNSETTLED}'] += 1
            return
        if self.assembler.joint.has_joint(message):
            publishers = self._states.publishers
            publishers.note(self._states.publisher, steady_ns())
            if publishers.active > 1:  # nothing says whose positions are right
                self.assembler.drops[SEVERAL] += 1
                return
        for sample in self.assembler.add_joint_state(message):
            self.samples.signalMessage(*sample)
            if self.assembler.is_waiting:
                self.release()

    def add_odometry(
        self, time_ns: int, position: Sequence[float], orientation: Sequence[float]
    ) -> None:
        """Add a pose of the frame of the clouds in that of odometry: [ns], [m], x y z w.

        Call `release` once all poses that wait are added. The first may be of before a scan that
        has waited too long, and the last of after it.
        """
        self.odometry.signalMessage(time_ns, position, orientation)
        self.assembler.add_odometry(time_ns, position, orientation)

    def odometry_went_back(self) -> None:
        """Forget the odometry: its time went back."""
        self.release()  # with the odometry of the time before
        self.assembler.odometry_went_back()
        self.release()

    def clock_was_set(self, step_ns: int) -> None:
        """Restart after the clock was set by a step [ns]; scans that wait are dropped."""
        self.assembler.clock_was_set(step_ns)
        self.release()

    def release(self) -> None:
        """Pass on the outcomes that are ready; call it regularly where no message may arrive."""
        for outcome in self.assembler.ready(self._clock.deadline_clock_ns()):
            self._warn_of(outcome)
            self.signalMessage(outcome)

    def _warn_of(self, outcome: Outcome) -> None:
        text = ''
        if outcome.dropped:
            text = f'scan dropped: {outcome.dropped}'
        elif outcome.uncompensated:
            text = f'motion not compensated: {outcome.uncompensated}'
        if text:
            missing = self.assembler.missing_input
            self._warn(f'{text} ({missing})' if missing else text)
