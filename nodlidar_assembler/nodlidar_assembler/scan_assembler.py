"""From scans to clouds: waits until joint samples and odometry bracket a scan, then assembles."""

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from nodlidar_assembler.clouds.ego_motion import Odometry, OdometryConfig, OdometryError
from nodlidar_assembler.clouds.joint_history import JointHistory, JointSamples
from nodlidar_assembler.clouds.odometry_history import OdometryHistory
from nodlidar_assembler.clouds.pipeline import Assembled, Pipeline, PipelineConfig, Scan
from nodlidar_assembler.clouds.pitch import PitchError
from nodlidar_assembler.clouds.points import Points
from nodlidar_assembler.clouds.repeats import RepeatedScanError
from nodlidar_assembler.waiting import WaitingLine
from nodlidar_common.errors import ParameterError
from nodlidar_common.parameters import parameter
from nodlidar_common.pose import Pose
from nodlidar_common.stamps import NS_PER_S
from nodlidar_common.time_order import TIME_JUMP_NS

NO_JOINT_BEFORE = 'no joint state before it'
NO_JOINT_AFTER = 'no joint state after it before the deadline'
JOINT_WENT_BACK = 'joint states went back in time'
NO_ODOMETRY_BEFORE = 'no odometry before it'
NO_ODOMETRY_AFTER = 'no odometry after it before the deadline'
ODOMETRY_WENT_BACK = 'odometry went back in time'
ONE_INSTANT = 'scans whose beams share one instant: set time_increment'

WITHOUT_ODOMETRY = ('drop', 'uncompensated')

_Bracketed = tuple[Scan, JointSamples]


@dataclass(frozen=True)
class ScanAssemblerConfig(PipelineConfig):
    """Waiting for joint samples and odometry, and ego-motion."""

    frame_id: str = parameter(
        'nodlidar_base_link',
        'Frame of the clouds: it does not nod; origin on the nod axis, x forward, z up',
    )
    deadline: float = parameter(
        0.3,
        'Longest time that a scan waits for joint samples, and then again for odometry',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    odom_frame: str = parameter(
        'odom',
        'Frame of odometry: TF has the pose of frame_id in it',
    )
    without_odometry: str = parameter(
        'drop',
        'What happens to a scan without odometry: drop, or uncompensated (its cloud is in '
        'frame_id; not with clouds per sweep)',
        choices=WITHOUT_ODOMETRY,
    )

    def check_together(self) -> None:
        """Raise ParameterError for frames and modes that exclude each other."""
        if self.ego_motion == 'off':
            return
        if self.odom_frame in ('', self.frame_id):
            limit = f"a frame other than frame_id = '{self.frame_id}'"
            raise ParameterError('odom_frame', limit, self.odom_frame)
        if self.cloud_mode == 'sweep' and self.without_odometry != 'drop':
            limit = 'drop with clouds per sweep, whose points are in one frame'
            raise ParameterError('without_odometry', limit, self.without_odometry)


@dataclass(frozen=True, slots=True)
class Outcome:
    """A scan, assembled or dropped.

    Attributes
    ----------
    scan
        The scan.
    assembled
        Its beams, points and clouds; None if it was dropped.
    dropped
        Reason for the drop; empty if it was assembled.
    uncompensated
        Reason why the configured compensation of the robot's motion failed; else empty.
    odometry
        Odometry from the first beam on, up to the newest sample, even if it did not compensate
        the clouds; None if there is none, or if it ends before that beam.
    """

    scan: Scan
    assembled: Assembled | None = None
    dropped: str = ''
    uncompensated: str = ''
    odometry: Odometry | None = None


class ScanAssembler:
    """Takes scans, joint samples and odometry as they arrive; yields an outcome per scan.

    A scan waits until joint samples bracket it and then, if the motion of the robot is
    compensated, until odometry does, each time up to the deadline. Else it does not wait for
    odometry.

    Parameters
    ----------
    config
        Parameters of the assembler.
    mount
        Pose of nodlidar_base_link in the frame whose odometry is added; None if it is the same.

    Attributes
    ----------
    drops
        Dropped scans, counted by reason.
    """

    def __init__(self, config: ScanAssemblerConfig, mount: Pose | None = None) -> None:
        deadline_ns = round(config.deadline * NS_PER_S)
        self._compensates = config.ego_motion != 'off'
        self._drops_uncompensated = config.without_odometry == 'drop'
        self._pipeline = Pipeline(config)
        self._joints = JointHistory()
        self._odometry = OdometryHistory(mount)
        self._motion_limits: OdometryConfig = config
        self._odometry_delay_ns = round(config.odometry_delay * NS_PER_S)
        self._compensated_until_ns: int | None = None  # last beam since odometry began [ns]
        self._for_joints: WaitingLine[Scan, JointSamples | str] = WaitingLine(deadline_ns)
        # Late odometry comes later by as much.
        self._for_odometry: WaitingLine[_Bracketed, Odometry | str] = WaitingLine(
            deadline_ns + max(self._odometry_delay_ns, 0)
        )
        self._decided: deque[Outcome] = deque()
        self.drops: Counter[str] = Counter()
        self._deviations: Counter[str] = Counter()

    @property
    def remarks(self) -> dict[str, int]:
        """Scans assembled differently than configured, counted by reason; points removed."""
        fallbacks = self._pipeline.estimator.fallbacks
        mixed_pixels = self._pipeline.mixed_pixels
        return {
            **({'points removed as mixed pixels': mixed_pixels} if mixed_pixels else {}),
            **self._deviations,
            **{f'slerp instead of trajectory: {reason}': n for reason, n in fallbacks.items()},
        }

    @property
    def newest_joint_ns(self) -> int | None:
        """Stamp of the newest joint sample [ns]; None if there is none."""
        return self._joints.newest_ns

    # Inputs.

    def add_scan(self, scan: Scan, now_ns: int) -> None:
        """Add a scan that waits from an instant [ns] on."""
        self._for_joints.add(scan, now_ns)

    def add_joint_sample(self, time_ns: int, pitch: float) -> None:
        """Add a joint sample [ns], [rad]; one older than the last means that time went back."""
        newest_ns = self.newest_joint_ns
        if newest_ns is not None and newest_ns > time_ns:
            self._forget_joints(JOINT_WENT_BACK)
        self._joints.add(time_ns, pitch)
        self._pipeline.add_sample(time_ns, pitch)

    def add_odometry(
        self, time_ns: int, position: Sequence[float], orientation: Sequence[float]
    ) -> None:
        """Add a pose of the robot in the frame of odometry: stamp [ns], x y z [m], x y z w.

        If it is more than a second older than the last one, time went back.
        """
        time_ns -= self._odometry_delay_ns
        if (self._odometry.newest_ns or 0) - time_ns > TIME_JUMP_NS:
            self.odometry_went_back()
        self._odometry.add(time_ns, position, orientation)

    def odometry_went_back(self) -> None:
        """Forget the odometry: time went back, and new samples are older."""
        self._forget_odometry(ODOMETRY_WENT_BACK)

    def command_sweeps(self, duration: float) -> None:
        """Note how long a sweep of the commanded nod takes [s]; up to twice that, it moves."""
        self._pipeline.command_sweeps(duration)

    def restart(self, reason: str) -> None:
        """Restart, as after the clock was set; waiting scans are dropped for the reason."""
        self._forget_odometry(reason)
        self._forget_joints(reason)
        self._pipeline.restart()

    # Outcomes.

    @property
    def is_waiting(self) -> bool:
        """Whether a scan waits, or an outcome for `ready`."""
        return bool(self._for_joints or self._for_odometry or self._decided)

    def ready(self, now_ns: int) -> Iterator[Outcome]:
        """Yield the outcomes that are known at an instant [ns] of the clock of `add_scan`."""
        while self._decided:
            yield self._decided.popleft()
        for scan, samples in self._for_joints.release(now_ns, self._samples_around):
            if isinstance(samples, str):
                yield self._drop(scan, samples)
            elif self._compensates:
                self._for_odometry.add((scan, samples), now_ns)
            else:
                yield self._assemble(scan, samples)
        for (scan, samples), odometry in self._for_odometry.release(now_ns, self._odometry_around):
            if isinstance(odometry, str):
                yield self._without_odometry(scan, samples, odometry)
            else:
                yield self._assemble(scan, samples, odometry)

    def flush(self) -> list[Points]:
        """Return the clouds that are left when no more scans come, also that of an open sweep."""
        return self._pipeline.flush()

    def _samples_around(self, scan: Scan, overdue: bool) -> JointSamples | str | None:
        """Return the joint samples around a scan, the reason to drop it, or None to wait."""
        joints, margin_ns = self._joints, self._pipeline.estimator.margin_ns
        begin_ns, end_ns = scan.stamp_ns, scan.end_ns
        last_ns = joints.after(end_ns + margin_ns)
        if last_ns is None and not overdue:
            return None
        if joints.after(end_ns) is None:
            return NO_JOINT_AFTER
        if joints.before(begin_ns) is None:
            return NO_JOINT_BEFORE
        first_ns = joints.before(begin_ns - margin_ns)
        return joints.between(
            begin_ns - margin_ns if first_ns is None else first_ns,
            end_ns + margin_ns if last_ns is None else last_ns,
        )

    def _odometry_around(self, waiting: _Bracketed, overdue: bool) -> Odometry | str | None:
        """Return the odometry from a scan on, the reason why there is none, or None to wait."""
        scan, newest_ns = waiting[0], self._odometry.newest_ns
        if not overdue and (newest_ns is None or newest_ns < scan.end_ns):
            return None
        return self._odometry_over(scan.stamp_ns, scan.end_ns)

    def _odometry_over(self, begin_ns: int, end_ns: int) -> Odometry | str:
        """Return all odometry from an instant to beyond another one [ns], or why there is none."""
        oldest_ns, newest_ns = self._odometry.oldest_ns, self._odometry.newest_ns
        if oldest_ns is None or newest_ns is None or newest_ns < end_ns:
            return NO_ODOMETRY_AFTER
        if oldest_ns > begin_ns:
            return NO_ODOMETRY_BEFORE
        try:
            return self._odometry.around(begin_ns, newest_ns)
        except OdometryError as error:
            return error.reason

    def _assemble(
        self,
        scan: Scan,
        samples: JointSamples,
        odometry: Odometry | None = None,
        uncompensated: str = '',
    ) -> Outcome:
        begin_ns, end_ns = scan.stamp_ns, scan.end_ns
        jumped = odometry is not None and self._jumped(begin_ns)
        try:
            assembled = self._pipeline.add_scan(scan, *samples, odometry, jumped)
        except (PitchError, RepeatedScanError) as error:
            return self._drop(scan, error.reason)
        except OdometryError as error:
            return self._without_odometry(scan, samples, error.reason)
        if scan.geometry.time_increment == 0.0:
            self._deviations[ONE_INSTANT] += 1
        if odometry is not None:
            self._compensated_until_ns = end_ns
        found = odometry or self._odometry_over(begin_ns, begin_ns)
        known = None if isinstance(found, str) else found
        return Outcome(scan, assembled, uncompensated=uncompensated, odometry=known)

    def _jumped(self, begin_ns: int) -> bool:
        """Return whether odometry has jumped between the last compensated scan and an instant."""
        before_ns, oldest_ns = self._compensated_until_ns, self._odometry.oldest_ns
        if before_ns is None or oldest_ns is None or before_ns < oldest_ns:
            return True  # its motion meanwhile is unknown
        try:
            between = self._odometry.around(min(before_ns, begin_ns), begin_ns)
        except OdometryError:
            return True
        return bool(len(between.jumps_ns(self._motion_limits)))

    def _without_odometry(self, scan: Scan, samples: JointSamples, reason: str) -> Outcome:
        if self._drops_uncompensated:
            return self._drop(scan, reason)
        self._deviations[f'uncompensated: {reason}'] += 1
        return self._assemble(scan, samples, uncompensated=reason)

    def _drop(self, scan: Scan, reason: str) -> Outcome:
        self.drops[reason] += 1
        return Outcome(scan, dropped=reason)

    def _forget_joints(self, reason: str) -> None:
        self._joints.clear()
        self._decided += [self._drop(scan, reason) for scan in self._for_joints.clear()]

    def _forget_odometry(self, reason: str) -> None:
        self._odometry.clear()
        self._compensated_until_ns = None
        for scan, samples in self._for_odometry.clear():
            self._decided.append(self._without_odometry(scan, samples, reason))
